#include "core/odometry/frame_registration.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr double kStopTranslation_m = 1e-3;
constexpr double kStopRotation_rad = 1e-4;
// Fewer matches than this do not make a pose.
constexpr std::size_t kMinMatches = 60;
// Nor do matches of fewer than this share of the points, or matches of which fewer than that share lie on their planes.
constexpr double kMinMatchedShare = 0.1;
constexpr double kMinNearShare = 0.5;
constexpr float kNear_m = 0.1F;
// Beyond this distance a match speaks against the motion that it was found with.
constexpr double kFit_m = 0.05;
// A scan shows structure along a direction with so many points that face it; a map of the same place has more than this
// share of them.
constexpr double kMinFacingPoints = 20.0;
constexpr double kFoundShare = 0.25;
// So many points that could speak for a motion over the ground are more than chance.
constexpr double kTellingPoints = 50.0;
// Level and biases, which a start under acceleration gets wrong, are known after so long: before, a prediction by the
// IMU is no judge.
constexpr double kSettling_s = 3.0;
// One by the IMU that may be off by more than this is no better than one without: anything finds something to match.
constexpr double kSurePrediction_m = 0.3;

bool converged(const Vector6d& step) {
    return step.head<3>().norm() < kStopTranslation_m && step.tail<3>().norm() < kStopRotation_rad;
}

/// How far the pose may be from the prediction. At speed, and the more in fast turns, an offset between the clocks of
/// IMU and lidar counts, too.
Matrix6d prediction_covariance(const MotionFilter& filter) {
    constexpr double kOffset_s = ImuBuffer::kClockOffset_s;
    Vector6d motion_of_sensor;
    motion_of_sensor << filter.state().velocity_mps,
        filter.T_world_sensor().rotation() * filter.sensor_angular_velocity();
    return filter.covariance().topLeftCorner<6, 6>() +
           kOffset_s * kOffset_s * motion_of_sensor * motion_of_sensor.transpose();
}

}  // namespace

FrameRegistration::FrameRegistration(const ScanToScanConfig& first_stage, const ScanToSubmapConfig& second_stage)
    : submap_iterations_(second_stage.iterations),
      residual_cap_m_(second_stage.residual_cap_m),
      scan_to_scan_(first_stage),
      scan_to_submap_(second_stage) {}

void FrameRegistration::begin(const Frame& frame) {
    const double duration_s = static_cast<double>(frame.header.stamp_ns - frame.header.first_stamp_ns) * 1e-9;
    scan_.begin(frame.prepared.points, frame.header.stamp_ns, duration_s);
    iterations_ = 0;
}

void FrameRegistration::set_target(const PlacedScan& scan, const Eigen::Isometry3d& T_world_sensor) {
    T_world_target_ = T_world_sensor;
    const Eigen::Isometry3d T_local_sensor = Eigen::Translation3d(-scan.origin_m()) * T_world_sensor;
    scan_to_scan_.set_target(scan.points(), scan.left_out(), scan.placed(), T_local_sensor.inverse().cast<float>());
}

/// Gauss-Newton steps of the filter with what `match(i)` finds.
template <class Match>
void FrameRegistration::iterate(MotionFilter& filter, int most, Match&& match) {
    const double predicted_m = filter.prior_deviation().head<3>().norm();
    for (int i = 0; i < most; ++i) {
        if (i > 0) scan_.move(filter);
        match(i);
        if (!has_matches()) return;
        if (i == 0) {
            accumulate(matches_, equations_);
            held_.judge(matches_, equations_, filter.uses_imu() && predicted_m < kSurePrediction_m);
        }
        const Observability& seen = held_.observability();
        if (i > 0) seen.leave_facing(matches_);
        const bool asks = filter.uses_imu() && filter.age_s() > kSettling_s && seen.any_weak();
        if (asks) seen.ask_prediction(matches_, filter.correction().head<6>(), prediction_covariance(filter));
        if (i > 0 || asks) accumulate(matches_, equations_);
        ++iterations_;
        last_step_ = filter.step(equations_, held_.observability().directions());
        if (converged(last_step_)) return;
    }
}

void FrameRegistration::align(MotionFilter& filter, VoxelMap& submap, const Effort& effort) {
    const double predicted_m = filter.position_deviation_m();
    filter.begin_update();
    matches_.clear();
    held_.begin_frame();
    if (scan_to_scan_.has_target()) {
        const Eigen::Isometry3f T_target_local =
            (T_world_target_.inverse() * Eigen::Translation3d(scan_.origin_m())).cast<float>();
        iterate(filter, effort.first_stage_iterations, [&](int) {
            scan_to_scan_.match(scan_.points(), scan_.left_out(), scan_.placed(), T_target_local, effort.widening,
                                matches_);
        });
        scan_.move(filter);
    }
    // The guess may be as far off as the prediction, or as the two disagree.
    const double deviation_m = std::max(predicted_m, filter.correction().head<3>().norm());
    iterate(filter, submap_iterations_, [&](int i) {
        scan_to_submap_.match(scan_.points(), scan_.left_out(), scan_.placed(), submap, scan_.origin(),
                              i == 0 ? 2.0 * effort.widening : 1.0, matches_, deviation_m);
    });
}

void FrameRegistration::match(VoxelMap& submap) {
    match(scan_, submap, matches_);
}

void FrameRegistration::match(const PlacedScan& scan, VoxelMap& submap, PlaneMatches& matches) const {
    scan_to_submap_.match(scan.points(), scan.left_out(), scan.placed(), submap, scan.origin(), 1.0, matches);
}

bool FrameRegistration::has_matches() const {
    return matches_.count >= kMinMatches;
}

bool FrameRegistration::lies_on_plane(const PlaneMatches& matches, std::size_t i) {
    return std::abs(matches.residual[i]) < kNear_m;
}

/// Matches on their planes count for the motion, those off them against it. The ground itself says nothing: its rings
/// look the same from everywhere.
MatchQuality FrameRegistration::quality() const {
    MatchQuality quality;
    for (std::size_t i = 0; i < matches_.count; ++i) {
        quality.near += lies_on_plane(matches_, i) ? 1.0 : 0.0;
        const auto nx = static_cast<double>(matches_.h[0][i]);
        const auto ny = static_cast<double>(matches_.h[1][i]);
        const double r = static_cast<double>(matches_.residual[i]) / kFit_m;
        quality.fit += (nx * nx + ny * ny) * std::max(-1.0, 1.0 - r * r);
    }
    const PlacedPoints& placed = scan_.placed();
    for (std::size_t i = 0; i < scan_.left_out().size(); ++i) {
        if (!scan_.takes_part(i)) continue;
        quality.seen += static_cast<double>(placed.nx[i] * placed.nx[i] + placed.ny[i] * placed.ny[i]);
    }
    return quality;
}

bool FrameRegistration::is_trustworthy(const MatchQuality& quality) const {
    const auto count = static_cast<double>(matches_.count);
    return has_matches() && count >= kMinMatchedShare * static_cast<double>(scan_.candidates()) &&
           quality.near >= kMinNearShare * count;
}

bool FrameRegistration::contradicts(const MatchQuality& quality, double least_share) {
    return quality.seen >= kTellingPoints && quality.fit < least_share * quality.seen;
}

bool FrameRegistration::is_beside_its_map(const Matrix6d& covariance, double max_deviation_m) const {
    const Observability::Directions held_directions = held_.observability().directions();
    const PlacedPoints& placed = scan_.placed();
    for (Eigen::Index k = 0; k < held_directions.cols(); ++k) {
        const Vector6d direction = held_directions.col(k);
        if (direction.head<3>().isZero()) continue;
        if (direction.dot(covariance * direction) < max_deviation_m * max_deviation_m) continue;
        const Eigen::Vector3f u = direction.head<3>().cast<float>();
        double seen = 0.0;
        for (std::size_t i = 0; i < scan_.left_out().size(); ++i) {
            const float along = placed.nx[i] * u.x() + placed.ny[i] * u.y() + placed.nz[i] * u.z();
            seen += scan_.takes_part(i) && Observability::is_facing(along) ? 1.0 : 0.0;
        }
        double found = 0.0;
        for (std::size_t i = 0; i < matches_.count; ++i) {
            const float along = matches_.h[0][i] * u.x() + matches_.h[1][i] * u.y() + matches_.h[2][i] * u.z();
            found += Observability::is_facing(along) ? 1.0 : 0.0;
        }
        if (seen >= kMinFacingPoints && found < kFoundShare * seen) return true;
    }
    return false;
}

void FrameRegistration::residuals(VoxelMap& submap, const Image<std::uint8_t>& ground, OdometryResult& out) const {
    scan_to_submap_.residuals(scan_.points(), scan_.placed(), submap, scan_.origin(), out.residual_pixel,
                              out.residual_m, &ground);
    out.residual_cap_m = static_cast<float>(residual_cap_m_);
}

}  // namespace dlod
