// Registration of a frame in two stages, with the motion over its sweep.
#include <algorithm>
#include <cmath>

#include "core/map/keyframe_cloud.hpp"
#include "core/odometry/odometry_state.hpp"

namespace dlod {
namespace {

constexpr double kStopTranslation_m = 1e-3;
constexpr double kStopRotation_rad = 1e-4;
// Fewer matches than this do not make a pose.
constexpr std::size_t kMinMatches = 60;
// Nor do matches of fewer than this share of the points, or matches of which fewer than that share lie on their planes.
constexpr double kMinMatchedShare = 0.1;
constexpr double kMinNearShare = 0.5;
constexpr double kNear_m = 0.1;
constexpr int kBootstrapPasses = 5;
constexpr int kBootstrapIterations = 10;
// Gates open as the prediction's standard deviation grows beyond this.
constexpr double kSureDeviation_m = 0.1;
constexpr double kMaxWidening = 3.0;

bool converged(const MotionFilter::Step& step) {
    return step.translation_m < kStopTranslation_m && step.rotation_rad < kStopRotation_rad;
}

}  // namespace

bool Odometry::State::estimate(const Frame& frame) {
    filter.predict(frame.header.stamp_ns);
    choose_origin();
    update_sweep(frame);
    if (!frame.header.usable) return false;
    const PointSelection& points = frame.prepared.points;
    keyframes.update_submap(filter.state().position_m);
    moving.mark(placed, origin_m, frame.header.stamp_ns, excluded);
    candidates = 0;
    for (std::size_t i = 0; i < excluded.size(); ++i) candidates += points.planarity[i] > 0.0F && !excluded[i] ? 1 : 0;
    if (bootstrapping) {
        bootstrap(frame);
    } else {
        const double deviation = std::sqrt(filter.pose_covariance().diagonal().head<3>().sum());
        const double widening = std::clamp(deviation / kSureDeviation_m, 1.0, kMaxWidening);
        register_frame(frame, widening > 1.0 ? kBootstrapIterations : config.scan_to_scan.iterations, widening);
    }
    if (is_trustworthy()) {
        filter.finish_update();
        held.end_frame();
        if (filter.uses_imu() && monitor.quiet()) {
            const Observability::Directions u = held.observability().directions();
            for (Eigen::Index k = 0; k < u.cols(); ++k) filter.observe_rest(u.col(k).head<3>());
        }
        return true;
    }
    filter.discard_update();
    return false;
}

/// Enough points have found the submap, and most of those lie on it. Counts the latter.
bool Odometry::State::is_trustworthy() {
    near = 0;
    for (std::size_t i = 0; i < matches.count; ++i) near += std::abs(matches.residual[i]) < kNear_m ? 1 : 0;
    if (matches.count < kMinMatches ||
        static_cast<double>(matches.count) < kMinMatchedShare * static_cast<double>(candidates)) {
        return false;
    }
    return static_cast<double>(near) >= kMinNearShare * static_cast<double>(matches.count);
}

/// Number of points up to the last one that takes part in the registration: they come first.
std::size_t Odometry::State::taking_part(const PointSelection& points) {
    std::size_t count = points.size();
    while (count > 0 && points.planarity[count - 1] <= 0.0F) --count;
    return count;
}

/// The first scan could not be deskewed for its motion: now that the second one tells it, do both again. What counts is
/// the way from one pose to the other; two scans that are skewed alike would fit at any velocity.
void Odometry::State::bootstrap(const Frame& frame) {
    const double dt = static_cast<double>(frame.header.stamp_ns - first_filter.stamp_ns()) * 1e-9;
    for (int pass = 0; pass < kBootstrapPasses; ++pass) {
        register_frame(frame, kBootstrapIterations, 1.0);
        if (pass == 0) register_widely(frame);
        if (pass + 1 == kBootstrapPasses || matches.count < kMinMatches) break;
        const MotionFilter::Vector correction = filter.correction();
        MotionFilter again = first_filter;
        again.set_motion(again.state().velocity_mps + correction.segment<3>(0) / dt,
                         filter.uses_imu()
                             ? again.state().rate_radps
                             : Eigen::Vector3d(again.state().rate_radps +
                                               again.state().rotation.conjugate() * correction.segment<3>(3) / dt));
        again.sweep(first_duration_s, origin_m, motion);
        place(first_points, motion, placed);
        place_provisional();
        place_target(first_points, {}, again.T_world_sensor());
        first_filter = again;
        filter = again;
        filter.predict(frame.header.stamp_ns);
        update_sweep(frame);
    }
}

/// Once more with open gates, for a robot that is already fast; that is kept if it explains clearly more of the scan.
void Odometry::State::register_widely(const Frame& frame) {
    is_trustworthy();
    const auto narrow_near = static_cast<double>(near);
    const MotionFilter narrow = filter;
    filter.discard_update();
    update_sweep(frame);
    register_frame(frame, kBootstrapIterations, kMaxWidening);
    is_trustworthy();
    if (static_cast<double>(near) > kClearlyBetter * narrow_near) return;
    filter = narrow;
    update_sweep(frame);
    scan_to_submap.match(frame.prepared.points, excluded, placed, keyframes.submap(), origin, 1.0, matches);
}

/// Makes the placed points, of the first scan, the submap until there are keyframes.
void Odometry::State::place_provisional() {
    KeyframeCloud cloud;
    build_keyframe_cloud(placed, origin_m, cloud);
    keyframes.set_provisional(cloud);
}

/// Both stages: the first for the guess, the second for the pose. The filter's prediction is the prior of either.
void Odometry::State::register_frame(const Frame& frame, int first_stage_iterations, double widening) {
    const PointSelection& points = frame.prepared.points;
    filter.begin_update();
    matches.clear();
    held.begin_frame();
    const auto iterate = [&](int most, auto&& match) {
        for (int i = 0; i < most; ++i) {
            if (i > 0) update_sweep(frame);
            match(i);
            if (matches.count < kMinMatches) return;
            if (i > 0) held.observability().leave_facing(matches);
            accumulate(matches, equations);
            if (i == 0) held.judge(matches, equations, filter.uses_imu());
            ++iterations;
            if (converged(filter.step(equations, held.observability().directions()))) return;
        }
    };
    if (scan_to_scan.has_target()) {
        const Eigen::Isometry3f T_target_local =
            (T_world_target.inverse() * Eigen::Translation3d(origin_m)).cast<float>();
        iterate(first_stage_iterations,
                [&](int) { scan_to_scan.match(points, excluded, placed, T_target_local, widening, matches); });
        update_sweep(frame);
    }
    iterate(config.scan_to_submap.iterations, [&](int i) {
        scan_to_submap.match(points, excluded, placed, keyframes.submap(), origin, i == 0 ? 2.0 * widening : 1.0,
                             matches);
    });
    if (held.observability().unobservable() > 0) flags |= OdometryResult::kDegenerate;
}

/// The motion over the sweep as the filter sees it now, and the points that take part after it.
void Odometry::State::update_sweep(const Frame& frame) {
    const double duration = static_cast<double>(frame.header.stamp_ns - frame.header.first_stamp_ns) * 1e-9;
    filter.sweep(std::clamp(duration, 1e-3, kMaxSweep_s), origin_m, motion);
    place(frame.prepared.points, excluded.size(), motion, placed);
}

/// The local frame of this scan: the world moved to a corner of the voxels near the sensor.
void Odometry::State::choose_origin() {
    const double side = keyframes.submap().voxel_m();
    const Eigen::Vector3d p = filter.state().position_m / side;
    origin = {static_cast<std::int32_t>(std::floor(p.x())), static_cast<std::int32_t>(std::floor(p.y())),
              static_cast<std::int32_t>(std::floor(p.z()))};
    origin_m = side * Eigen::Vector3d(origin.x, origin.y, origin.z);
}

/// Makes the placed points the target of the first stage.
void Odometry::State::place_target(const PointSelection& points, std::span<const std::uint8_t> without,
                                   const Eigen::Isometry3d& T_world_sensor) {
    T_world_target = T_world_sensor;
    const Eigen::Isometry3d T_local_sensor = Eigen::Translation3d(-origin_m) * T_world_sensor;
    scan_to_scan.set_target(points, without, placed, T_local_sensor.inverse().cast<float>());
}

}  // namespace dlod
