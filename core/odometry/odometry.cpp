#include "core/odometry/odometry_state.hpp"

namespace dlod {
namespace {

// A scan with fewer flat points is not worth beginning with.
constexpr std::size_t kMinFirstPoints = 100;
// With fewer matches near their planes than this share of the usual the IMU is suspected.
constexpr double kPoorShare = 0.6;
// Of two registrations one is better with so many times more matches near their planes.
constexpr double kClearlyBetter = 1.2;
// The same by the surfaces that tell a motion over the ground, and what it takes to be as usual again.
constexpr double kPoorFit = 0.2;
constexpr double kUsualFit = 0.4;
constexpr double kNearSmoothing = 0.2;
// After so long without a registration the map is given up.
constexpr double kLost_s = 2.0;
// Looking around the prediction costs some frames' time.
constexpr double kSearchEvery_s = 0.5;
// Without a scan for longer than this there is no prediction worth the name.
constexpr double kMaxGap_s = 5.0;
constexpr double kStandardGravity_mps2 = 9.80665;
// Started in motion: the acceleration that is in what the accelerometer feels, how well the level has to be known, and
// from which scan on the motion is known well enough for a map.
constexpr double kStartAcceleration_mps2 = 1.0;
constexpr double kLevel_rad = 0.035;
constexpr int kFirstGoodScan = 2;
// Of what comes out as gravity: accelerometers are off by some hundredths of it.
constexpr double kMaxGravityError_mps2 = 0.6;
// A start that leaves more of the positions unexplained is tried again, so many times.
constexpr double kMaxScatter = 1.0;
constexpr int kMaxRetries = 3;
// So many times what makes a direction observable has to face it before the lidar accuses the IMU of a wrong position.
constexpr double kAccusationDemand = 6.0;
// Where the robot may be after that: standard deviations.
constexpr double kAway_m = 15.0;
constexpr double kAway_rad = 1.0;

Matrix6d away() {
    Vector6d deviation;
    deviation << Eigen::Vector3d::Constant(kAway_m), Eigen::Vector3d::Constant(kAway_rad);
    return deviation.cwiseAbs2().asDiagonal();
}

/// The rotation that turns this direction of the sensor's frame upwards, and its x axis to yaw 0.
Eigen::Matrix3d levelled(const Eigen::Vector3d& up) {
    const Eigen::Vector3d left = up.cross(Eigen::Vector3d::UnitX()).normalized();
    Eigen::Matrix3d R;
    R << left.cross(up).normalized().transpose(), left.transpose(), up.normalized().transpose();
    return R;
}

}  // namespace

Odometry::Odometry(const SensorModel& sensor, const OdometryConfig& config)
    : state_(std::make_unique<State>(sensor, config)) {}
Odometry::~Odometry() = default;

void Odometry::process(Frame& frame, const OdometryFeedback* feedback) {
    state_->process(frame, feedback);
}

Odometry::State::State(const SensorModel& sensor_model, const OdometryConfig& configuration)
    : sensor(sensor_model),
      config(configuration),
      filter(configuration.motion, sensor_model.T_sensor_imu.inverse()),
      keyframes(configuration.keyframes, configuration.voxels),
      scan_to_scan(configuration.scan_to_scan),
      scan_to_submap(configuration.scan_to_submap),
      first_filter(filter) {}

void Odometry::State::process(Frame& frame, const OdometryFeedback* feedback) {
    if (feedback != nullptr) apply(*feedback);
    if (frame.header.valid_columns == 0) {
        // Such a frame has no time of its own: nothing is to be learnt from it, and nothing to be predicted for it.
        write_nothing(frame);
        return;
    }
    const int taken = config.use_imu ? imu.add(frame.imu) : 0;
    monitor.see_samples(frame.imu, taken, imu.newest_ns(), frame.header.stamp_ns);
    excluded.reserve(frame.prepared.points.pixel.capacity());
    excluded.assign(taking_part(frame.prepared.points), 0);
    flags = 0;
    iterations = 0;
    registered = false;
    just_started = false;
    trusted = true;
    void_scan_ns.reset();
    const double step_s = static_cast<double>(frame.header.stamp_ns - filter.stamp_ns()) * 1e-9;
    const bool lost = started && static_cast<double>(frame.header.stamp_ns - last_registered_ns) * 1e-9 > kLost_s;
    if (!started) {
        if (frame.header.usable && flat_points(frame) >= kMinFirstPoints) start(frame, Eigen::Isometry3d::Identity());
    } else if (step_s <= 0.0 || step_s > kMaxGap_s) {
        // The sensor was away, or its clock has jumped: whatever a prediction over such a time gave would be invented.
        imu.clear();
        imu.add(frame.imu);
        restart(frame, away());
        trusted = false;
    } else {
        choose_motion_model(frame);
        const MotionFilter before = filter;
        registered = estimate(frame);
        if (frame.header.usable && filter.uses_imu() && !bootstrapping) {
            const bool poor = !registered || static_cast<double>(near) < kPoorShare * usual_near ||
                              (level_known && fit() < kPoorFit * usual_fit);
            const bool absurd = registered && !imu_is_consistent();
            if (poor || absurd) retry_without_imu(frame, before, absurd);
        }
        if (!registered && frame.header.usable && !bootstrapping) {
            const double since_s = static_cast<double>(frame.header.stamp_ns - searched_ns) * 1e-9;
            if (predicted_deviation_m() > config.max_deviation_m && since_s > kSearchEvery_s) {
                searched_ns = frame.header.stamp_ns;
                registered = find_again(frame);
            }
        }
        // Two first scans that do not fit each other: one of them is no good, and which will be seen.
        const bool bad_start = bootstrapping && flat_points(frame) >= kMinFirstPoints;
        if (!registered && frame.header.usable && (lost || bad_start)) {
            restart(frame, Matrix6d::Zero());
            trusted = false;
        } else {
            bootstrapping = bootstrapping && !registered;
        }
    }
    if (!started) {
        write_nothing(frame);
        return;
    }
    level(frame);
    update_sweep(frame);
    write_result(frame);
    if (registered) {
        see_motion(frame);
        usual_near += kNearSmoothing * (static_cast<double>(near) - usual_near);
        usual_fit += kNearSmoothing * (fit() - usual_fit);
        last_registered_ns = frame.header.stamp_ns;
        place_target(frame.prepared.points, excluded, filter.T_world_sensor());
    }
}

/// A robot that is in motion when it starts feels its acceleration beside gravity. Until the first scans show where
/// down is no pose is to be used, and with the first one that is the world begins.
void Odometry::State::level(const Frame& frame) {
    if (level_known) return;
    trusted = false;
    if (!filter.uses_imu()) {
        level_known = true;
        return;
    }
    scans_since_start = just_started ? 0 : scans_since_start + (registered ? 1 : 0);
    if (!registered || scans_since_start < kFirstGoodScan) return;
    if (held.observability().unobservable() > 0) {
        // What is held follows the accelerometer, and says nothing of it.
        start_level.clear();
        return;
    }
    // The scans before this one were deskewed for a motion that was not known yet.
    if (scans_since_start == kFirstGoodScan) renew_map(frame);
    start_level.add(filter.state(), frame.header.stamp_ns, imu);
    const auto gravity = start_level.gravity();
    if (!gravity || gravity->deviation_mps2 > kLevel_rad * kStandardGravity_mps2) return;
    const bool is_gravity = std::abs(gravity->mps2.norm() - kStandardGravity_mps2) < kMaxGravityError_mps2;
    if ((!is_gravity || gravity->scatter > kMaxScatter) && retries < kMaxRetries) {
        // The accelerometer does not feel the motion that the lidar sees: it may have taken a crowd for the world.
        ++retries;
        restart(frame, Matrix6d::Zero());
        return;
    }
    if (std::sqrt(gravity->scatter) * gravity->deviation_mps2 > kLevel_rad * kStandardGravity_mps2) return;
    begin_world(frame, *gravity);
    level_known = true;
    trusted = true;
}

/// This scan is the map from now on.
void Odometry::State::renew_map(const Frame& frame) {
    keyframes.clear();
    map_sequence = frame.header.sequence;
    choose_origin();
    update_sweep(frame);
    place(frame.prepared.points, motion, placed);
    place_provisional();
}

/// The world begins anew with this scan, level.
void Odometry::State::begin_world(const Frame& frame, const StartLevel::Gravity& gravity) {
    const Eigen::Isometry3d T_before = filter.T_world_sensor();
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = levelled(-(T_before.linear().transpose() * gravity.mps2));
    filter.begin_world(T, gravity.deviation_mps2);
    target_rotation = Eigen::Quaterniond(T.linear() * T_before.linear().transpose()) * target_rotation;
    anchor.setZero();
    start_covariance.setZero();
    start_position_m.setZero();
    world_sequence = frame.header.sequence;
    just_started = true;
    flags |= OdometryResult::kReinitialized;
    renew_map(frame);
}

/// The prediction by the IMU may have misled the registration: does the lidar alone do better?
/// @param absurd what the IMU says can not be: the lidar alone counts if it does no worse
void Odometry::State::retry_without_imu(const Frame& frame, const MotionFilter& before, bool absurd) {
    const MotionFilter with_imu = filter;
    const bool was_registered = registered;
    const double was_near = static_cast<double>(near);
    const double was_fit = fit();
    filter = before;
    use_constant_velocity();
    registered = estimate(frame);
    const bool better = static_cast<double>(near) > kClearlyBetter * was_near || (absurd && fit() >= was_fit) ||
                        (level_known && was_fit < kPoorFit * usual_fit && fit() > kUsualFit * usual_fit);
    if (registered && (!was_registered || better)) {
        monitor.blame();
        flags |= OdometryResult::kImuFaulty;
        return;
    }
    filter = with_imu;
    registered = was_registered;
    near = static_cast<std::size_t>(was_near);
}

void Odometry::State::use_constant_velocity() {
    filter.use_imu(nullptr);
    filter.set_motion(filter.state().velocity_mps, lidar_rate_radps);
}

void Odometry::State::apply(const OdometryFeedback& feedback) {
    if (feedback.sequence < world_sequence) return;
    for (const OrientedBox& box : feedback.cleared) keyframes.remove_points(box);
    // One of before a restart is of another map.
    if (feedback.has_keyframe && feedback.sequence >= map_sequence) keyframes.add(feedback.keyframe);
    moving.set(feedback.moving, feedback.stamp_ns);
}

/// With the IMU while it behaves, without it otherwise.
void Odometry::State::choose_motion_model(const Frame& frame) {
    if (filter.uses_imu() && !monitor.usable()) {
        use_constant_velocity();
    } else if (!filter.uses_imu() && monitor.usable() && !frame.imu.empty()) {
        filter.use_imu(&imu);
        if (!gravity_known) filter.set_gravity(-kStandardGravity_mps2 * (filter.state().rotation * mean_force(frame)));
        gravity_known = true;
    }
    if (monitor.faulty()) flags |= OdometryResult::kImuFaulty;
}

/// Tells the monitor how far off the prediction by the IMU was. Where it is trusted more than the lidar, what the lidar
/// would still change counts, too.
bool Odometry::State::imu_is_consistent() {
    const MotionFilter::Vector correction = filter.correction();
    const MotionFilter::Vector deviation = filter.prior_deviation();
    const Vector6d left = from_scan * equations.b[0];
    const double clock_m = kClockOffset_s * filter.state().velocity_mps.norm();
    const double position_m2 =
        deviation.head<3>().squaredNorm() + from_scan.topLeftCorner<3, 3>().trace() + clock_m * clock_m;
    // Before the level is known its error moves the prediction; and in a tunnel a van may be all that faces along it.
    const bool shown = Observability::of(matches, equations, kAccusationDemand).unobservable() == 0;
    const double position_m = level_known && shown ? (correction.head<3>() - left.head<3>()).norm() : 0.0;
    return monitor.see_correction({.position_m = position_m,
                                   .position_deviation_m = std::sqrt(position_m2),
                                   .rotation_rad = correction.segment<3>(3).norm(),
                                   .rotation_deviation_rad = deviation.segment<3>(3).norm(),
                                   .velocity_mps = correction.segment<3>(6).norm(),
                                   .velocity_deviation_mps = deviation.segment<3>(6).norm()});
}

/// Mean specific force over the frame, body axes; 0 where there is none.
Eigen::Vector3d Odometry::State::specific_force(const Frame& frame) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int samples = 0;
    for (const ImuSample& sample : frame.imu) {
        if (!sample.acceleration_mps2.allFinite()) continue;
        sum += sample.acceleration_mps2.cast<double>();
        ++samples;
    }
    return sum / std::max(1, samples);
}

/// Its direction: up, when at rest.
Eigen::Vector3d Odometry::State::mean_force(const Frame& frame) {
    const Eigen::Vector3d force = specific_force(frame);
    return force.norm() > 0.1 ? Eigen::Vector3d(force.normalized()) : Eigen::Vector3d::UnitZ();
}

/// Smoothed points of surfaces: what makes a scan worth beginning with.
std::size_t Odometry::State::flat_points(const Frame& frame) {
    const PointSelection& points = frame.prepared.points;
    std::size_t flat = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        flat += points.nx[i] != 0.0F || points.ny[i] != 0.0F || points.nz[i] != 0.0F ? 1 : 0;
    }
    return flat;
}

/// Begins a map with this scan. Nothing is known of its velocity yet, unless the IMU is quiet: the next scan will tell.
void Odometry::State::start(const Frame& frame, const Eigen::Isometry3d& T_world_sensor) {
    const bool with_imu = monitor.usable() && !imu.empty();
    Eigen::Isometry3d T = T_world_sensor;
    if (!started && with_imu) {
        T.linear() = levelled(sensor.T_sensor_imu.linear() * mean_force(frame));
        level_known = monitor.quiet();
    }
    const Eigen::Vector3d gravity =
        started ? filter.state().gravity_mps2 : Eigen::Vector3d(0.0, 0.0, -kStandardGravity_mps2);
    filter.initialize(T, gravity, frame.header.stamp_ns, with_imu ? &imu : nullptr);
    if (with_imu && !level_known) filter.doubt_gravity(kStartAcceleration_mps2);
    start_level.clear();
    if (with_imu && monitor.quiet()) {
        for (int axis = 0; axis < 3; ++axis) filter.observe_rest(Eigen::Vector3d::Unit(axis));
    }
    if (monitor.faulty()) flags |= OdometryResult::kImuFaulty;
    gravity_known = gravity_known || with_imu;
    started = true;
    map_sequence = frame.header.sequence;
    bootstrapping = true;
    registered = true;
    just_started = true;
    start_ns = frame.header.stamp_ns;
    start_position_m = T.translation();
    choose_origin();
    update_sweep(frame);
    first_filter = filter;
    first_motion = filter.state();
    first_points = frame.prepared.points;
    first_duration_s = static_cast<double>(motion.duration_s);
    place(first_points, motion, placed);
    place_provisional();
}

/// Goes on with a new map from where the robot is believed to be: it is lost, or the sensor's clock has jumped back.
/// @param moved covariance of what the robot may have moved since the prediction
void Odometry::State::restart(const Frame& frame, const Matrix6d& moved) {
    flags |= OdometryResult::kReinitialized;
    keyframes.clear();
    held.reset();
    start_covariance = anchor + filter.pose_covariance() + moved;
    start(frame, filter.T_world_sensor());
}

/// Turn and change of velocity since the last registered scan after the lidar, beside what the IMU says.
void Odometry::State::see_motion(const Frame& frame) {
    const std::int64_t stamp_ns = frame.header.stamp_ns;
    const double dt = static_cast<double>(stamp_ns - target_ns) * 1e-9;
    const Eigen::Quaterniond rotation = filter.state().rotation;
    const Eigen::Vector3d velocity_mps = filter.state().velocity_mps;
    if (target_ns != 0 && dt > 0.0 && dt < kMaxSweep_s) {
        const Eigen::Vector3d turn = so3_log(target_rotation.conjugate() * rotation);
        lidar_rate_radps = turn / dt;
        if (!imu.empty()) {
            const Eigen::Vector3d free_mps2 = (velocity_mps - target_velocity_mps) / dt - filter.state().gravity_mps2;
            const Eigen::Vector3d force_mps2 = rotation * specific_force(frame);
            monitor.see_motion(imu.turn(target_ns, stamp_ns) - turn,
                               gravity_known ? (force_mps2 - free_mps2).norm() : force_mps2.norm() - free_mps2.norm());
        }
    }
    target_ns = stamp_ns;
    target_rotation = rotation;
    target_velocity_mps = velocity_mps;
}

}  // namespace dlod
