// Has an object moved? Its own points are registered to those it had a while ago, in the ground plane.
//
// The shift of a box centre says little of a partly seen thing: more of a static object comes into view, and a wall
// seen through an opening seems to move. Distances to tangent planes do not have these faults: a wall that slides along
// itself still lies in its own plane, and a side that comes into view matches neither "stayed" nor "moved".
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "core/types/frame.hpp"

namespace dlod {

/// Some of an object's points with their normals, spread over its pixels.
struct PointSample {
    static constexpr std::size_t kCapacity = 40;

    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< world frame; the points are relative to it
    std::array<float, kCapacity> x{}, y{}, z{};          ///< world axes, metres
    std::array<float, kCapacity> nx{}, ny{};             ///< unit normal in the ground plane
    std::size_t size = 0;
    double age_s = 0.0;  ///< before now
};

/// Takes points evenly from a detection's pixels; those without a normal (edges, level surfaces) are left out.
/// @param width of the image
void sample_points(const Frame& frame, std::span<const PixelIndex> pixels, PointSample& out);

struct RegisteredDisplacement {
    Eigen::Vector2d displacement_m = Eigen::Vector2d::Zero();  ///< ground plane, that fits best
    double stayed_m2 = 0.0;  ///< mean squared distance to the tangent planes without displacement, outliers bounded
    double moved_m2 = 0.0;   ///< likewise with it
    double in_place = 1.0;   ///< share of the points that still lie where the surface was
    /// The same of those points of which a motion in one direction would show, in the direction where it is least; 0
    /// where too little shows it.
    double in_place_every_way = 0.0;
    /// How well the normals fix a displacement in the direction where they do so least; 0.5: in all directions alike.
    double observable = 0.0;
    Eigen::Matrix2d normals = Eigen::Matrix2d::Zero();  ///< mean of n n^T over the points that fit when displaced
    int points = 0;                                     ///< so many do
};

/// Whether two samples show the same side of what stands at a place: they were seen from directions less than 40
/// degrees apart. What is passed by closely turns another side to the sensor, which seems displaced.
bool show_same_side(const PointSample& before, const PointSample& now, const Eigen::Vector2d& place_m);

/// Registers `now` to `before` by translation in the ground plane.
/// @param guess_m where to start beside "stayed"
RegisteredDisplacement register_displacement(const PointSample& before, const PointSample& now,
                                             const Eigen::Vector2d& guess_m);

/// Covariance [m^2/s^2] of the mean velocity over the displacement: noise of the fit, worse where the normals do not
/// see a motion, and what an object may have accelerated since.
Eigen::Matrix2d velocity_covariance(const RegisteredDisplacement& r, double elapsed_s);

/// Squared length of the displacement in units of its noise: chi-squared of two degrees of freedom for what has stayed.
double displacement_chi2(const RegisteredDisplacement& r);

/// Whether an object stands: a motion at `speed_mps` or faster would have been seen, but most of its points lie where
/// they were, of all or of those that face either way, and so does its middle. Of a plane that moves along itself the
/// points alone do.
/// @param shift_m of the middle of the object, ground plane
bool stands(const RegisteredDisplacement& r, double elapsed_s, double speed_mps, double shift_m);

/// Log-odds of "moved" against "stayed": positive where a displacement explains the points much better than none,
/// negative where they lie where they were and a motion would have shown.
double displacement_log_odds(const RegisteredDisplacement& r, double elapsed_s);

}  // namespace dlod
