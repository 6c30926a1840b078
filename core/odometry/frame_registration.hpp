// Registration of a scan in two stages, with the motion over its sweep (paper, Sec. "Overview", Eq. 4).
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "core/map/voxel_map.hpp"
#include "core/odometry/held_directions.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/placed_scan.hpp"
#include "core/registration/normal_equations.hpp"
#include "core/registration/scan_to_scan.hpp"
#include "core/registration/scan_to_submap.hpp"

namespace dlod {

/// What speaks for a registration.
struct MatchQuality {
    double near = 0.0;  ///< matches that lie on their planes
    double fit = 0.0;   ///< what speaks for the motion over the ground, less what speaks against it
    double seen = 0.0;  ///< what of the scan could speak for it
};

/// The present scan against the one before, for the guess, then against the submap, for the pose. A filter's prediction
/// is the prior of either stage, and the filter is moved to where the scan fits.
class FrameRegistration {
  public:
    FrameRegistration(const ScanToScanConfig& first_stage, const ScanToSubmapConfig& second_stage);

    /// Another scan becomes the present one.
    void begin(const Frame& frame);
    PlacedScan& scan() { return scan_; }
    const PlacedScan& scan() const { return scan_; }
    /// This scan, placed in full, becomes the first stage's target.
    void set_target(const PlacedScan& scan, const Eigen::Isometry3d& T_world_sensor);

    struct Effort {
        int first_stage_iterations = kManyIterations;
        double widening = 1.0;  ///< factor on gates and kernels: above 1 while the guess is poor
    };
    static constexpr int kManyIterations = 10;
    /// Both stages. The filter is at the scan's stamp and has been predicted; its update is left unfinished.
    void align(MotionFilter& filter, VoxelMap& submap, const Effort& effort);
    /// Matches the scan as it is placed with the submap, once more.
    void match(VoxelMap& submap);

    /// Matches another scan with the submap.
    void match(const PlacedScan& scan, VoxelMap& submap, PlaneMatches& matches) const;
    static bool lies_on_plane(const PlaneMatches& matches, std::size_t i);

    // Of the last matches.
    const PlaneMatches& matches() const { return matches_; }
    /// There are enough of them to go on with.
    bool has_matches() const;
    MatchQuality quality() const;
    /// Enough points have found the submap, and most of those lie on it.
    bool is_trustworthy(const MatchQuality& quality) const;
    /// The scan shows what tells a motion over the ground, and next to nothing of it lies where the map has it. Matches
    /// by chance, whose distances are any within the gate, speak against a motion: what is left is the ground, which
    /// looks the same from everywhere.
    /// @param least_share of what could speak for the motion, that has to
    static bool contradicts(const MatchQuality& quality, double least_share);
    /// The pose may be anywhere along a direction that the prediction holds, and yet the scan shows surfaces that face
    /// this direction: it is no tunnel, the map around the believed pose is another place's.
    /// @param covariance of the pose: translation, rotation, world
    bool is_beside_its_map(const Matrix6d& covariance, double max_deviation_m) const;

    // Of the last alignment.
    const NormalEquations& equations() const { return equations_; }
    const Vector6d& last_step() const { return last_step_; }  ///< of the filter: translation, rotation
    HeldDirections& held() { return held_; }
    const HeldDirections& held() const { return held_; }
    bool is_degenerate() const { return held_.observability().unobservable() > 0; }
    /// Of all alignments of the present scan.
    int iterations() const { return iterations_; }

    /// Distances of all points, which have to be placed, to the submap.
    void residuals(VoxelMap& submap, const Image<std::uint8_t>& ground, OdometryResult& out) const;

  private:
    template <class Match>
    void iterate(MotionFilter& filter, int most, Match&& match);

    int submap_iterations_;
    double residual_cap_m_;
    ScanToScan scan_to_scan_;
    ScanToSubmap scan_to_submap_;
    Eigen::Isometry3d T_world_target_ = Eigen::Isometry3d::Identity();
    PlacedScan scan_;
    HeldDirections held_;
    PlaneMatches matches_;
    NormalEquations equations_;
    Vector6d last_step_ = Vector6d::Zero();
    int iterations_ = 0;
};

}  // namespace dlod
