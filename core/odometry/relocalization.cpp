#include "core/odometry/relocalization.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dlod {
namespace {

constexpr double kSearchEvery_s = 0.5;
// So far around the prediction, and in such steps.
constexpr double kDeviations = 2.0;
constexpr double kStep_m = 0.7;
constexpr int kRings = 2;
constexpr int kDirections = 8;
constexpr double kStep_rad = 0.15;
constexpr int kTurns = 2;
constexpr double kWidening = 3.0;
constexpr int kTrialIterations = 4;
// The robot is found where so much more fits than at any place farther off than this, and no less than the least.
constexpr double kUniqueFit = 1.3;
constexpr double kLeastFit = 20.0;
constexpr double kElsewhere_m = 0.3;
constexpr double kElsewhere_rad = 0.1;

}  // namespace

bool Relocalization::is_due(std::int64_t stamp_ns) const {
    return static_cast<double>(stamp_ns - searched_ns_) * 1e-9 > kSearchEvery_s;
}

bool Relocalization::find(FrameRegistration& registration, MotionFilter& filter, VoxelMap& submap) {
    searched_ns_ = filter.stamp_ns();
    const Matrix6d covariance = filter.pose_covariance();
    const double far_m = kDeviations * std::sqrt(covariance.topLeftCorner<2, 2>().trace());
    const double far_rad = kDeviations * std::sqrt(covariance(5, 5));
    const MotionFilter predicted = filter;
    const HeldDirections held = registration.held();
    MotionFilter best = predicted;
    Eigen::Isometry3d found = Eigen::Isometry3d::Identity();
    double best_fit = 0.0;
    double other_fit = 0.0;
    const auto align = [&](int first_stage_iterations) {
        registration.held().reset();
        registration.scan().move(filter);
        registration.align(filter, submap, {first_stage_iterations, kWidening});
    };
    const auto look = [&](const Eigen::Vector3d& offset_m, double turn_rad) {
        filter = predicted;
        filter.move(offset_m, turn_rad);
        const MotionFilter from = filter;
        align(kTrialIterations);
        registration.match(submap);
        const double fit = registration.quality().fit;
        const Eigen::Isometry3d difference = found.inverse() * filter.T_world_sensor();
        const bool elsewhere = difference.translation().norm() > kElsewhere_m ||
                               Eigen::AngleAxisd(difference.rotation()).angle() > kElsewhere_rad;
        if (elsewhere) other_fit = std::max(other_fit, std::min(fit, best_fit));
        if (fit > best_fit) {
            best_fit = fit;
            best = from;
            found = filter.T_world_sensor();
        }
    };
    for (int ring = 0; ring <= kRings && ring * kStep_m <= far_m; ++ring) {
        for (int heading = 0; heading < (ring == 0 ? 1 : kDirections); ++heading) {
            const double angle = 2.0 * std::numbers::pi * heading / kDirections;
            const Eigen::Vector3d offset_m = ring * kStep_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
            look(offset_m, 0.0);
            for (int turn = 1; turn <= kTurns && turn * kStep_rad <= far_rad; ++turn) {
                look(offset_m, turn * kStep_rad);
                look(offset_m, -turn * kStep_rad);
            }
        }
    }
    filter = best;
    align(FrameRegistration::kManyIterations);
    const MatchQuality quality = registration.quality();
    if (registration.is_trustworthy(quality) && quality.fit > std::max(kLeastFit, kUniqueFit * other_fit)) return true;
    filter = predicted;
    registration.held() = held;
    return false;
}

}  // namespace dlod
