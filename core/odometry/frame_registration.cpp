// Registration of a frame in two stages, with the motion over its sweep.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

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
// Beyond this distance a match speaks against the motion that it was found with.
constexpr double kFit_m = 0.05;
constexpr int kBootstrapPasses = 4;
constexpr int kBootstrapIterations = 10;
// A robot that stands, or nearly, sees so much of its first scan again.
constexpr double kSameViewShare = 0.85;
// For the same: surfaces by the direction that they face in the plan, and points of one that make it count.
constexpr std::size_t kViewDirections = 4;
constexpr double kMinViewPoints = 100.0;
// A scan shows structure along a direction with so many points that face it; a map of the same place has more than this
// share of them.
constexpr double kMinFacingPoints = 20.0;
constexpr double kFoundShare = 0.25;
// Looking for the robot around its prediction: so far, and in such steps.
constexpr double kSearchDeviations = 2.0;
constexpr double kSearchStep_m = 0.7;
constexpr int kSearchRings = 2;
constexpr double kSearchStep_rad = 0.15;
constexpr int kSearchTurns = 2;
// It is found where so much more fits than at any place farther off than this.
constexpr double kUniqueFit = 1.3;
constexpr double kElsewhere_m = 0.3;
constexpr double kElsewhere_rad = 0.1;
// What a robot may be at when it is switched on: velocities to begin with, in eight directions of the horizontal plane.
constexpr double kFirstSpeeds_mps[] = {5.0, 10.0, 15.0};
constexpr int kFirstDirections = 8;
constexpr int kTrialPasses = 2;
constexpr int kTrialIterations = 4;
constexpr double kClearlyBetterFit = 1.02;
// A first scan whose points turn out to be off by more, at that distance, is void.
constexpr double kMaxSkew_m = 0.05;
constexpr double kSkewReach_m = 10.0;
// Gates open as the prediction's standard deviation grows beyond this.
constexpr double kSureDeviation_m = 0.1;
constexpr double kMaxWidening = 3.0;
// Level and biases, which a start under acceleration gets wrong, are known after so long: before, a prediction by the
// IMU is no judge.
constexpr double kSettling_s = 3.0;
constexpr double kLagSmoothing = 0.1;

bool converged(const Vector6d& step) {
    return step.head<3>().norm() < kStopTranslation_m && step.tail<3>().norm() < kStopRotation_rad;
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
        const double deviation = predicted_deviation_m();
        const double widening = std::clamp(deviation / kSureDeviation_m, 1.0, kMaxWidening);
        register_frame(frame, widening > 1.0 ? kBootstrapIterations : config.scan_to_scan.iterations, widening);
    }
    if (is_trustworthy() && !is_beside_its_map(points)) {
        accept();
        return true;
    }
    filter.discard_update();
    return false;
}

void Odometry::State::accept() {
    if (bootstrapping && first_scan_is_void()) void_scan_ns = first_filter.stamp_ns();
    filter.finish_update();
    held.end_frame();
    see_uncertainty();
    if (filter.uses_imu() && monitor.quiet()) {
        const Observability::Directions u = held.observability().directions();
        for (Eigen::Index k = 0; k < u.cols(); ++k) filter.observe_rest(u.col(k).head<3>());
    }
}

/// The prediction may be too far off for the registration to find the way: looks around it, as far as it may be. What
/// is found counts if it explains clearly more than whatever is found elsewhere.
bool Odometry::State::find_again(const Frame& frame) {
    const Matrix6d deviation = filter.pose_covariance();
    const double far_m = kSearchDeviations * std::sqrt(deviation.topLeftCorner<2, 2>().trace());
    const double far_rad = kSearchDeviations * std::sqrt(deviation(5, 5));
    const MotionFilter predicted = filter;
    const HeldDirections held_before = held;
    const std::uint32_t flags_before = flags;
    MotionFilter best = predicted;
    Eigen::Isometry3d found = Eigen::Isometry3d::Identity();
    double best_fit = 0.0;
    double other_fit = 0.0;
    const auto look = [&](const Eigen::Vector3d& offset_m, double turn_rad) {
        filter = predicted;
        filter.move(offset_m, turn_rad);
        held.reset();
        const MotionFilter from = filter;
        update_sweep(frame);
        register_frame(frame, kTrialIterations, kMaxWidening);
        scan_to_submap.match(frame.prepared.points, excluded, placed, keyframes.submap(), origin, 1.0, matches);
        const double now = fit();
        const Eigen::Isometry3d difference = found.inverse() * filter.T_world_sensor();
        const bool elsewhere = difference.translation().norm() > kElsewhere_m ||
                               Eigen::AngleAxisd(difference.rotation()).angle() > kElsewhere_rad;
        if (elsewhere) other_fit = std::max(other_fit, std::min(now, best_fit));
        if (now > best_fit) {
            best_fit = now;
            best = from;
            found = filter.T_world_sensor();
        }
    };
    for (int ring = 0; ring <= kSearchRings && ring * kSearchStep_m <= far_m; ++ring) {
        for (int heading = 0; heading < (ring == 0 ? 1 : kFirstDirections); ++heading) {
            const double angle = 2.0 * std::numbers::pi * heading / kFirstDirections;
            const Eigen::Vector3d offset_m =
                ring * kSearchStep_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
            look(offset_m, 0.0);
            for (int turn = 1; turn <= kSearchTurns && turn * kSearchStep_rad <= far_rad; ++turn) {
                look(offset_m, turn * kSearchStep_rad);
                look(offset_m, -turn * kSearchStep_rad);
            }
        }
    }
    filter = best;
    held.reset();
    flags = flags_before;
    update_sweep(frame);
    register_frame(frame, kBootstrapIterations, kMaxWidening);
    if (is_trustworthy() && fit() > std::max(kMinFacingPoints, kUniqueFit * other_fit)) {
        accept();
        return true;
    }
    filter = predicted;
    held = held_before;
    flags = flags_before;
    return false;
}

/// What the matches leave uncertain, where nothing is held: their own errors, and those of the map.
void Odometry::State::see_uncertainty() {
    constexpr double kNothing = 1e-3;  // makes what is held invertible
    const Observability::Directions u = held.observability().directions();
    const Matrix6d free = Matrix6d::Identity() - u * u.transpose();
    const auto covariance = [&](const Matrix6d& information) {
        const Matrix6d both = free * information * free + u * u.transpose() + kNothing * Matrix6d::Identity();
        return Matrix6d(free * both.ldlt().solve(Matrix6d::Identity()) * free);
    };
    from_scan = covariance(equations.A[0]);
    from_map = covariance(surface_information.of(matches, config.surface_error_m));
    if (filter.uses_imu()) {
        lag.setZero();
    } else {
        // Without IMU the filter follows the scans no faster than a robot is taken to change its motion.
        const Vector6d left = from_scan * (equations.b[0] + equations.A[0] * last_step);
        const Matrix6d now = left * left.transpose();
        lag += kLagSmoothing * (now - lag);
        from_scan += now + lag + free * filter.sweep_noise(static_cast<double>(motion.duration_s)) * free;
    }
}

/// How far the pose may be from the prediction. At speed, and the more in fast turns, an offset between the clocks of
/// IMU and lidar counts, too.
Matrix6d Odometry::State::prediction_covariance() const {
    Vector6d motion_of_sensor;
    motion_of_sensor << filter.state().velocity_mps,
        filter.T_world_sensor().rotation() * filter.sensor_angular_velocity();
    return filter.covariance().topLeftCorner<6, 6>() +
           kClockOffset_s * kClockOffset_s * motion_of_sensor * motion_of_sensor.transpose();
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

/// The pose may be anywhere along a direction that the prediction holds, and yet the scan shows surfaces that face this
/// direction: it is no tunnel, the map around the believed pose is another place's.
bool Odometry::State::is_beside_its_map(const PointSelection& points) const {
    const Observability::Directions held_directions = held.observability().directions();
    const Matrix6d deviation = filter.pose_covariance();
    for (Eigen::Index k = 0; k < held_directions.cols(); ++k) {
        const Vector6d direction = held_directions.col(k);
        if (direction.head<3>().isZero()) continue;
        if (direction.dot(deviation * direction) < config.max_deviation_m * config.max_deviation_m) continue;
        const Eigen::Vector3f u = direction.head<3>().cast<float>();
        double seen = 0.0;
        for (std::size_t i = 0; i < excluded.size(); ++i) {
            const float along = placed.nx[i] * u.x() + placed.ny[i] * u.y() + placed.nz[i] * u.z();
            seen += points.planarity[i] > 0.0F && !excluded[i] && Observability::is_facing(along) ? 1.0 : 0.0;
        }
        double found = 0.0;
        for (std::size_t i = 0; i < matches.count; ++i) {
            const float along = matches.h[0][i] * u.x() + matches.h[1][i] * u.y() + matches.h[2][i] * u.z();
            found += Observability::is_facing(along) ? 1.0 : 0.0;
        }
        if (seen >= kMinFacingPoints && found < kFoundShare * seen) return true;
    }
    return false;
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
    const MotionFilter unmoved = first_filter;
    register_frame(frame, kBootstrapIterations, 1.0);
    is_trustworthy();
    first_filter = sees_the_same(frame.prepared.points) ? unmoved : likeliest_start(frame, unmoved);
    begin_again(frame);
    settle(frame, kBootstrapPasses, kBootstrapIterations);
    register_frame(frame, kBootstrapIterations, 1.0);
}

/// The first scan is seen again, as a whole and by its surfaces of every direction: in a street, facades and ground
/// look the same from everywhere, and only the little that faces along it tells a motion.
bool Odometry::State::sees_the_same(const PointSelection& points) const {
    if (static_cast<double>(near) < kSameViewShare * static_cast<double>(candidates)) return false;
    std::array<double, kViewDirections> seen{};
    std::array<double, kViewDirections> again{};
    const auto count = [](std::array<double, kViewDirections>& counts, float nx, float ny) {
        if (nx * nx + ny * ny < 0.5F) return;
        // Both sides of a surface are one direction. The axes lie in the middle of theirs.
        const double half_turns = std::atan2(static_cast<double>(ny), static_cast<double>(nx)) / std::numbers::pi + 2.0;
        ++counts[static_cast<std::size_t>(half_turns * kViewDirections + 0.5) % kViewDirections];
    };
    for (std::size_t i = 0; i < excluded.size(); ++i) {
        if (points.planarity[i] > 0.0F && !excluded[i]) count(seen, placed.nx[i], placed.ny[i]);
    }
    for (std::size_t i = 0; i < matches.count; ++i) {
        if (std::abs(matches.residual[i]) < kNear_m) count(again, matches.h[0][i], matches.h[1][i]);
    }
    for (std::size_t k = 0; k < kViewDirections; ++k) {
        if (seen[k] >= kMinViewPoints && again[k] < kSameViewShare * seen[k]) return false;
    }
    return true;
}

/// The robot may be fast already: beyond a metre or so between two scans, the registration finds the nearest of what
/// looks alike. Of the ways that it finds from several velocities the one counts that explains most of the scan; a
/// faster one has to explain clearly more.
MotionFilter Odometry::State::likeliest_start(const Frame& frame, const MotionFilter& unmoved) {
    const std::uint32_t flags_before = flags;  // what is seen from a wrong velocity is not said of the frame
    MotionFilter best = unmoved;
    double best_fit = 0.0;
    const auto try_velocity = [&](const Eigen::Vector3d& velocity_mps) {
        first_filter = unmoved;
        first_filter.forget_velocity();
        first_filter.set_motion(velocity_mps, unmoved.state().rate_radps);
        begin_again(frame);
        settle(frame, kTrialPasses, kTrialIterations);
        // One motion has to explain both the way between the scans and the skew of each.
        scan_to_submap.match(frame.prepared.points, excluded, placed, keyframes.submap(), origin, 1.0, matches);
        if (const double now = fit(); now > kClearlyBetterFit * best_fit) {
            best_fit = now;
            best = first_filter;
        }
    };
    try_velocity(unmoved.state().velocity_mps);
    for (const double speed_mps : kFirstSpeeds_mps) {
        for (int direction = 0; direction < kFirstDirections; ++direction) {
            const double heading = 2.0 * std::numbers::pi * direction / kFirstDirections;
            try_velocity(unmoved.state().rotation *
                         Eigen::Vector3d(speed_mps * std::cos(heading), speed_mps * std::sin(heading), 0.0));
        }
    }
    flags = flags_before;
    return best;
}

/// The first scan was published deskewed for a motion that was not its own: its points are off by more than a little.
bool Odometry::State::first_scan_is_void() const {
    const MotionState& now = first_filter.state();
    const double turn_rad = (now.rate_radps - first_motion.rate_radps).norm() * first_duration_s;
    const double way_m = (now.velocity_mps - first_motion.velocity_mps).norm() * first_duration_s;
    return way_m + kSkewReach_m * turn_rad > kMaxSkew_m;
}

/// Registers the scan and deskews the first one for the motion that this gives, so many times.
void Odometry::State::settle(const Frame& frame, int passes, int iterations_a_pass) {
    const double dt = static_cast<double>(frame.header.stamp_ns - first_filter.stamp_ns()) * 1e-9;
    for (int pass = 0; pass < passes; ++pass) {
        register_frame(frame, iterations_a_pass, 1.0);
        if (matches.count < kMinMatches) return;
        const MotionFilter::Vector correction = filter.correction();
        const MotionState& first = first_filter.state();
        Eigen::Vector3d rate = first.rate_radps;
        if (!filter.uses_imu()) rate += first.rotation.conjugate() * correction.segment<3>(3) / dt;
        first_filter.set_motion(first.velocity_mps + correction.segment<3>(0) / dt, rate);
        begin_again(frame);
    }
}

/// What speaks for a motion over the ground, less what speaks against it: matches on their planes count for it, those
/// off them against it. The ground itself says nothing: its rings look the same from everywhere.
double Odometry::State::fit() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < matches.count; ++i) {
        const auto nx = static_cast<double>(matches.h[0][i]);
        const auto ny = static_cast<double>(matches.h[1][i]);
        const double r = static_cast<double>(matches.residual[i]) / kFit_m;
        sum += (nx * nx + ny * ny) * std::max(-1.0, 1.0 - r * r);
    }
    return sum;
}

/// Back to the first scan, with the motion that is now believed of it; then the prediction for the present one.
void Odometry::State::begin_again(const Frame& frame) {
    first_filter.sweep(first_duration_s, origin_m, motion);
    place(first_points, motion, placed);
    place_provisional();
    place_target(first_points, {}, first_filter.T_world_sensor());
    filter = first_filter;
    filter.predict(frame.header.stamp_ns);
    update_sweep(frame);
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
    const double predicted_m = predicted_deviation_m();
    const double since_start_s = static_cast<double>(frame.header.stamp_ns - start_ns) * 1e-9;
    filter.begin_update();
    matches.clear();
    held.begin_frame();
    const auto iterate = [&](int most, auto&& match) {
        for (int i = 0; i < most; ++i) {
            if (i > 0) update_sweep(frame);
            match(i);
            if (matches.count < kMinMatches) return;
            if (i == 0) {
                accumulate(matches, equations);
                held.judge(matches, equations, filter.uses_imu());
            }
            const Observability& seen = held.observability();
            if (i > 0) seen.leave_facing(matches);
            const bool asks = filter.uses_imu() && since_start_s > kSettling_s && seen.any_weak();
            if (asks) seen.ask_prediction(matches, filter.correction().head<6>(), prediction_covariance());
            if (i > 0 || asks) accumulate(matches, equations);
            ++iterations;
            last_step = filter.step(equations, held.observability().directions());
            if (converged(last_step)) return;
        }
    };
    if (scan_to_scan.has_target()) {
        const Eigen::Isometry3f T_target_local =
            (T_world_target.inverse() * Eigen::Translation3d(origin_m)).cast<float>();
        iterate(first_stage_iterations,
                [&](int) { scan_to_scan.match(points, excluded, placed, T_target_local, widening, matches); });
        update_sweep(frame);
    }
    // The guess may be as far off as the prediction, or as the two disagree.
    const double deviation_m = std::max(predicted_m, filter.correction().head<3>().norm());
    iterate(config.scan_to_submap.iterations, [&](int i) {
        scan_to_submap.match(points, excluded, placed, keyframes.submap(), origin, i == 0 ? 2.0 * widening : 1.0,
                             matches, deviation_m);
    });
    if (held.observability().unobservable() > 0) flags |= OdometryResult::kDegenerate;
}

/// Of the position before the update.
double Odometry::State::predicted_deviation_m() const {
    return std::sqrt(filter.pose_covariance().diagonal().head<3>().sum());
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
