#include "core/odometry/standstill.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/registration/observability.hpp"

namespace dlod {
namespace {

// A surface that is farther off than this has a quarter of its weight: several times the noise of a window.
constexpr float kKernel_m = 0.03F;
// With fewer surfaces, or with less than this share of them nearer than that, nothing is known.
constexpr std::size_t kLeastSurfaces = 200;
constexpr double kNearShare = 0.7;
// So many times what makes a direction observable has to face it: a van beside the robot is no evidence.
constexpr double kDemand = 6.0;
// Standard deviation of the motion that would be seen, in the worst direction, were all surfaces independent.
constexpr double kMaxDeviation_m = 1e-3;
// What is seen of it up to here is none: several times the noise.
constexpr double kMoved_m = 3e-3;
constexpr double kTurned_rad = 3e-4;

}  // namespace

Standstill::Standstill(const SensorModel& sensor) : by_pixel_(sensor.pixels(), 0) {}

bool Standstill::see(const PointSelection& points, bool slow) {
    const bool same = shows_no_motion(points);
    standing_ = same && (standing_ || slow);
    if (!same) begin(points);
    return standing_;
}

/// The motion since the scan that is compared with is none, and would be seen.
bool Standstill::shows_no_motion(const PointSelection& points) {
    matches_.reserve(points.pixel.capacity());
    matches_.clear();
    std::size_t near = 0;
    for (std::size_t i = 0; i < points.size() && points.is_flat(i); ++i) {
        const std::uint32_t number = by_pixel_[points.pixel[i]];
        if (number == 0) continue;
        const Surface& before = surfaces_[number - 1];
        const float position[3] = {points.x[i], points.y[i], points.z[i]};
        float off = 0.0F;
        for (int k = 0; k < 3; ++k) off += before.normal[k] * (position[k] - before.position[k]);
        const float root = 1.0F / (1.0F + off * off / (kKernel_m * kKernel_m));
        near += std::abs(off) < kKernel_m ? 1 : 0;
        matches_.push(before.normal, position, off, root * root, 0.0F, 0, static_cast<std::uint32_t>(i));
    }
    if (matches_.count < kLeastSurfaces) return false;
    if (static_cast<double>(near) < kNearShare * static_cast<double>(matches_.count)) return false;
    accumulate(matches_, equations_);
    const Observability seen = Observability::of(matches_, equations_, kDemand);
    if (seen.unobservable() > 0) return false;
    seen.leave_facing(matches_);
    accumulate(matches_, equations_);
    double weights = 0.0;
    for (std::size_t i = 0; i < matches_.count; ++i) weights += static_cast<double>(matches_.weight[i]);
    const double variance = equations_.weighted_squares / weights;
    const Matrix6d inverse = equations_.A[0].ldlt().solve(Matrix6d::Identity());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inverse.topLeftCorner<3, 3>(), Eigen::EigenvaluesOnly);
    if (!(variance * solver.eigenvalues()[2] < kMaxDeviation_m * kMaxDeviation_m)) return false;
    const Vector6d motion = inverse * equations_.b[0];
    return motion.head<3>().norm() < kMoved_m && motion.tail<3>().norm() < kTurned_rad;
}

void Standstill::begin(const PointSelection& points) {
    standing_ = false;
    for (const PixelIndex pixel : pixels_) by_pixel_[pixel] = 0;
    surfaces_.reserve(points.pixel.capacity());
    pixels_.reserve(points.pixel.capacity());
    surfaces_.clear();
    pixels_.clear();
    for (std::size_t i = 0; i < points.size() && points.is_flat(i); ++i) {
        surfaces_.push_back({{points.x[i], points.y[i], points.z[i]}, {points.nx[i], points.ny[i], points.nz[i]}});
        pixels_.push_back(points.pixel[i]);
        by_pixel_[points.pixel[i]] = static_cast<std::uint32_t>(surfaces_.size());
    }
}

}  // namespace dlod
