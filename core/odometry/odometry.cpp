// The course of a frame. What is said of it: odometry_result.cpp.
#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

// A scan with fewer flat points is not worth beginning with.
constexpr std::size_t kMinFirstPoints = 100;
// After so long without a registration, or in doubt, the map is given up.
constexpr double kLost_s = 2.0;
// Scans with fewer of their columns do not show all that there is.
constexpr double kWholeShare = 0.8;
// Frames farther apart have a gap between them.
constexpr double kLongestPeriod_s = 0.2;
// Without a scan for longer than this there is no prediction worth the name.
constexpr double kMaxGap_s = 5.0;
// Where the robot may be after that: standard deviations.
constexpr double kAway_m = 15.0;
constexpr double kAway_rad = 1.0;
// Gates open as the prediction's standard deviation grows beyond this.
constexpr double kSureDeviation_m = 0.1;
// A pose that was in doubt is not any more with a smaller one: velocities are known to half a metre a second.
constexpr double kShownDeviation_m = 0.05;
constexpr double kMaxWidening = 3.0;
// Of what could speak for the motion over the ground, this share has to.
constexpr double kLeastShare = 0.1;
constexpr double kLeastShareAtStart = 0.2;
// From one scan to the next a robot changes its velocity by less than this over a tenth of a second.
constexpr double kPlausibleCorrection_m = 0.1;
// The motion of a robot that stands is known no better than this.
constexpr double kSlow_mps = 0.15;
constexpr double kSlow_radps = 0.1;

Matrix6d away() {
    Vector6d deviation;
    deviation << Eigen::Vector3d::Constant(kAway_m), Eigen::Vector3d::Constant(kAway_rad);
    return deviation.cwiseAbs2().asDiagonal();
}

}  // namespace

Odometry::Odometry(const SensorModel& sensor, const OdometryConfig& config)
    : sensor_(sensor),
      config_(config),
      imu_(config.use_imu),
      filter_(config.motion, sensor.T_sensor_imu.inverse()),
      registration_(config.scan_to_scan, config.scan_to_submap),
      keyframes_(config.keyframes, config.voxels),
      standstill_(sensor),
      bootstrap_(filter_),
      uncertainty_(config.surface_error_m) {}

void Odometry::process(Frame& frame, const OdometryFeedback* feedback) {
    if (feedback != nullptr) apply(*feedback);
    if (frame.header.valid_columns == 0) {
        // Such a frame has no time of its own: nothing is to be learnt from it, and nothing to be predicted for it.
        write_nothing(frame);
        return;
    }
    now_ = {};
    imu_.see_samples(frame);
    if (imu_.faulty()) now_.flags |= OdometryResult::kImuFaulty;
    registration_.begin(frame);
    if (started_) {
        follow(frame);
    } else if (frame.header.usable && registration_.scan().flat_points() >= kMinFirstPoints) {
        begin_world(frame);
    }
    if (!started_) {
        write_nothing(frame);
        return;
    }
    now_.trusted = now_.trusted && (sure_ || now_.begins_map);
    level(frame);
    registration_.scan().move(filter_);
    write_result(frame);
    if (now_.registered) remember(frame);
}

void Odometry::apply(const OdometryFeedback& feedback) {
    if (feedback.sequence < world_sequence_) return;
    for (const OrientedBox& box : feedback.cleared) keyframes_.remove_points(box);
    // One of before a restart is of another map.
    if (feedback.has_keyframe && feedback.sequence >= map_sequence_) keyframes_.add(feedback.keyframe);
    moving_.set(feedback.moving, feedback.stamp_ns);
}

/// The first scan: the world is level if the IMU is at rest.
void Odometry::begin_world(const Frame& frame) {
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    if (imu_.usable()) {
        T_world_sensor.linear() = levelled(sensor_.T_sensor_imu.linear() * ImuUse::up(frame));
        if (!imu_.at_rest()) levelling_.begin_in_motion();
    }
    begin_map(frame, T_world_sensor, Matrix6d::Zero());
}

/// The robot's way goes on with this frame.
void Odometry::follow(const Frame& frame) {
    const double step_s = static_cast<double>(frame.header.stamp_ns - filter_.stamp_ns()) * 1e-9;
    if (step_s <= 0.0 || step_s > kMaxGap_s) {
        // The sensor was away, or its clock has jumped: whatever a prediction over such a time gave would be invented.
        imu_.forget_before(frame);
        begin_map_here(frame, away());
        return;
    }
    imu_.choose_model(filter_, frame, registered_motion_.rate_radps());
    const MotionFilter before = filter_;
    now_.registered = register_frame(frame);
    if (!frame.header.usable) return;
    if (!bootstrap_.pending()) {
        if (filter_.uses_imu()) {
            const bool poor = doubts_imu();
            const bool absurd =
                now_.registered && !imu_.agrees(filter_, registration_, uncertainty_.from_scan(), levelling_.known());
            if (poor || absurd) retry_without_imu(frame, before, absurd);
        }
        now_.registered = now_.registered || find_again(frame);
    }
    if (now_.registered) {
        judge();
        bootstrap_.end();
        missing_since_ns_.reset();
        if (sure_) sure_ns_ = frame.header.stamp_ns;
        if (static_cast<double>(frame.header.stamp_ns - sure_ns_) * 1e-9 > kLost_s) {
            begin_map_here(frame, Matrix6d::Zero());
        }
        return;
    }
    // Two first scans that do not fit each other: one of them is no good, and which will be seen.
    const bool bad_start = bootstrap_.pending() && registration_.scan().flat_points() >= kMinFirstPoints;
    // Over a gap nobody has looked: what counts is the time for which scans do not fit.
    if (!missing_since_ns_) {
        missing_since_ns_ = frame.header.stamp_ns - static_cast<std::int64_t>(std::min(step_s, kLongestPeriod_s) * 1e9);
    }
    const bool lost = static_cast<double>(frame.header.stamp_ns - *missing_since_ns_) * 1e-9 > kLost_s;
    if (lost || bad_start) begin_map_here(frame, Matrix6d::Zero());
}

/// Predicts the pose, and puts it where the scan fits the map.
bool Odometry::register_frame(const Frame& frame) {
    PlacedScan& scan = registration_.scan();
    const bool standing = stands(frame);
    if (standing) {
        filter_.stand(frame.header.stamp_ns);
    } else {
        filter_.predict(frame.header.stamp_ns);
    }
    scan.choose_origin(filter_.state().position_m, keyframes_.submap().voxel_m());
    scan.move(filter_);
    if (!frame.header.usable) return false;
    keyframes_.update_submap(filter_.state().position_m);
    scan.leave_out(moving_);
    if (bootstrap_.pending() && !standing) {
        bootstrap_.align(registration_, filter_, keyframes_, imu_.at_rest());
    } else {
        const double widening = std::clamp(filter_.position_deviation_m() / kSureDeviation_m, 1.0, kMaxWidening);
        const int iterations = widening > 1.0 ? FrameRegistration::kManyIterations : config_.scan_to_scan.iterations;
        registration_.align(filter_, keyframes_.submap(), {iterations, widening});
    }
    if (registration_.is_degenerate()) now_.flags |= OdometryResult::kDegenerate;
    now_.quality = registration_.quality();
    if (registration_.is_trustworthy(now_.quality) && !starts_badly(frame) &&
        !registration_.is_beside_its_map(filter_.pose_covariance(), config_.max_deviation_m)) {
        accept();
        return true;
    }
    filter_.discard_update();
    return false;
}

/// A motion that a single body tells may be that body's. Without IMU nothing supports the motion of a start but that
/// the two scans fit, and that the way from one to the other is that of the motion which both have been deskewed for.
bool Odometry::starts_badly(const Frame& frame) const {
    if (!bootstrap_.pending()) return false;
    // Where packets are missing, so may be all others that could tell.
    const bool whole = frame.header.valid_columns >= kWholeShare * sensor_.width;
    if (whole && !bootstrap_.is_told()) return true;
    if (filter_.uses_imu()) return false;
    return FrameRegistration::contradicts(now_.quality, kLeastShareAtStart) ||
           filter_.correction().head<3>().norm() > kPlausibleCorrection_m;
}

/// Without IMU a sudden turn or shock can take the scan farther from its prediction than a registration finds back.
/// What then holds the pose is the prediction, though the scan shows what faces those directions.
bool Odometry::contradicts_map() const {
    return registration_.is_degenerate() && !filter_.uses_imu() &&
           FrameRegistration::contradicts(now_.quality, kLeastShare);
}

/// Without IMU a pose that is in doubt stays so, and nothing becomes part of the map, until a scan shows where the
/// robot is, in all directions and better than its prediction: that nothing speaks against it is not enough. So does
/// the first one, until the next scan shows that it is worth beginning with; else the world begins with a later one.
void Odometry::judge() {
    now_.trusted = !contradicts_map();
    const bool shown = now_.trusted && !registration_.is_degenerate() &&
                       filter_.position_deviation_m() < kShownDeviation_m &&
                       filter_.correction().head<3>().norm() < kPlausibleCorrection_m;
    sure_ = filter_.uses_imu() || shown || (sure_ && now_.trusted);
    now_.fits = filter_.uses_imu() || !usual_.lacks_fit(now_.quality);
}

/// Without IMU, whose motion could not tell a robot that stands from one that is slow.
bool Odometry::stands(const Frame& frame) {
    if (!frame.header.usable || filter_.uses_imu()) return false;
    const bool slow =
        filter_.state().velocity_mps.norm() < kSlow_mps && filter_.state().rate_radps.norm() < kSlow_radps;
    return standstill_.see(frame.prepared.points, slow);
}

/// The registration is believed.
void Odometry::accept() {
    if (bootstrap_.pending()) now_.void_scan_ns = bootstrap_.void_scan_ns();
    filter_.finish_update();
    registration_.held().end_frame();
    see_uncertainty();
    if (filter_.uses_imu() && imu_.at_rest()) {
        const Observability::Directions held = registration_.held().observability().directions();
        for (Eigen::Index k = 0; k < held.cols(); ++k) filter_.observe_rest(held.col(k).head<3>());
    }
}

void Odometry::see_uncertainty() {
    const Observability::Directions held = registration_.held().observability().directions();
    const NormalEquations& equations = registration_.equations();
    uncertainty_.see_matches(registration_.matches(), equations, held);
    if (filter_.uses_imu()) {
        uncertainty_.see_no_lag();
    } else {
        const auto duration_s = static_cast<double>(registration_.scan().motion().duration_s);
        uncertainty_.see_lag(equations, registration_.last_step(), filter_.sweep_noise(duration_s), held);
    }
}

/// The prediction by the IMU may have misled the registration.
bool Odometry::doubts_imu() const {
    return !now_.registered || usual_.lacks_matches(now_.quality) ||
           (levelling_.known() && usual_.lacks_fit(now_.quality));
}

/// Does the lidar alone do better?
/// @param absurd what the IMU says can not be: the lidar alone counts if it does no worse
void Odometry::retry_without_imu(const Frame& frame, const MotionFilter& before, bool absurd) {
    const MotionFilter with_imu = filter_;
    const HeldDirections held = registration_.held();
    const PoseUncertainty uncertainty = uncertainty_;
    const Course first = now_;
    filter_ = before;
    ImuUse::drop(filter_, registered_motion_.rate_radps());
    now_.registered = register_frame(frame);
    const bool better = usual_.is_better(first.quality, now_.quality, levelling_.known()) ||
                        (absurd && now_.quality.fit >= first.quality.fit);
    if (now_.registered && (!first.registered || better)) {
        imu_.blame();
        now_.flags |= OdometryResult::kImuFaulty;
        return;
    }
    filter_ = with_imu;
    registration_.held() = held;
    uncertainty_ = uncertainty;
    now_ = first;
}

/// Where the robot may be farther from its prediction than a pose may be off, looks around it.
bool Odometry::find_again(const Frame& frame) {
    if (filter_.position_deviation_m() <= config_.max_deviation_m) return false;
    if (!relocalization_.is_due(frame.header.stamp_ns)) return false;
    if (!relocalization_.find(registration_, filter_, keyframes_.submap())) return false;
    if (registration_.is_degenerate()) now_.flags |= OdometryResult::kDegenerate;
    now_.quality = registration_.quality();
    accept();
    return true;
}

/// Begins a map with this scan. Nothing is known of its velocity yet, unless the IMU is at rest: the next scan will
/// tell.
/// @param covariance of the pose
void Odometry::begin_map(const Frame& frame, const Eigen::Isometry3d& T_world_sensor, const Matrix6d& covariance) {
    const Eigen::Vector3d gravity_mps2 = started_ ? filter_.state().gravity_mps2 : MotionState{}.gravity_mps2;
    imu_.initialize(filter_, T_world_sensor, gravity_mps2, frame.header.stamp_ns);
    if (!filter_.uses_imu()) {
        levelling_.give_up();
    } else {
        if (!levelling_.known()) filter_.doubt_gravity(Levelling::kStartAcceleration_mps2);
        for (int axis = 0; imu_.at_rest() && axis < 3; ++axis) filter_.observe_rest(Eigen::Vector3d::Unit(axis));
    }
    started_ = true;
    now_.registered = true;
    now_.begins_map = true;
    sure_ = filter_.uses_imu();
    sure_ns_ = frame.header.stamp_ns;
    missing_since_ns_.reset();
    map_sequence_ = frame.header.sequence;
    levelling_.begin_map();
    uncertainty_.begin_map(T_world_sensor.translation(), covariance);
    PlacedScan& scan = registration_.scan();
    scan.choose_origin(filter_.state().position_m, keyframes_.submap().voxel_m());
    scan.move_all(filter_);
    bootstrap_.begin(scan, filter_);
    standstill_.begin(frame.prepared.points);
    keyframes_.set_provisional(scan.cloud());
}

/// Goes on with a new map from where the robot is believed to be: it is lost, or the sensor's clock has jumped back.
/// @param moved covariance of what the robot may have moved since the prediction
void Odometry::begin_map_here(const Frame& frame, const Matrix6d& moved) {
    now_.flags |= OdometryResult::kReinitialized;
    now_.trusted = false;
    keyframes_.clear();
    registration_.held().reset();
    begin_map(frame, filter_.T_world_sensor(), uncertainty_.of_predicted(filter_.pose_covariance()) + moved);
}

/// This scan is the map from now on.
void Odometry::renew_map(const Frame& frame) {
    keyframes_.clear();
    map_sequence_ = frame.header.sequence;
    PlacedScan& scan = registration_.scan();
    scan.choose_origin(filter_.state().position_m, keyframes_.submap().voxel_m());
    scan.move_all(filter_);
    keyframes_.set_provisional(scan.cloud());
}

/// No pose is to be used before it shows where down is.
void Odometry::level(const Frame& frame) {
    if (levelling_.known()) return;
    now_.trusted = false;
    if (!filter_.uses_imu()) {
        levelling_.give_up();
        return;
    }
    const bool shows_motion =
        now_.registered && !registration_.is_degenerate() && filter_.state().velocity_mps.norm() > kSlow_mps;
    if (imu_.at_rest() && !shows_motion) {
        begin_world_at_rest(frame);
        return;
    }
    if (now_.begins_map || !now_.registered) return;
    switch (levelling_.see_scan(filter_, imu_.samples(), registration_.is_degenerate())) {
        case Levelling::Next::kWait:
            break;
        case Levelling::Next::kRenewMap:
            renew_map(frame);
            break;
        case Levelling::Next::kStartAgain:
            begin_map_here(frame, Matrix6d::Zero());
            break;
        case Levelling::Next::kBeginWorld:
            begin_levelled_world(frame);
            break;
    }
}

/// The robot has come to rest before it was known where down is: now it is, and that it does not move.
void Odometry::begin_world_at_rest(const Frame& frame) {
    now_.flags |= OdometryResult::kReinitialized;
    levelling_.give_up();
    keyframes_.clear();
    registration_.held().reset();
    world_sequence_ = frame.header.sequence;
    started_ = false;
    begin_world(frame);
}

/// The world begins anew with this scan, level.
void Odometry::begin_levelled_world(const Frame& frame) {
    const StartLevel::Gravity gravity = levelling_.gravity();
    const Eigen::Isometry3d T_before = filter_.T_world_sensor();
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = levelled(-(T_before.linear().transpose() * gravity.mps2));
    filter_.begin_world(T, gravity.deviation_mps2);
    registered_motion_.turn_world(T.linear() * T_before.linear().transpose());
    uncertainty_.begin_map(Eigen::Vector3d::Zero(), Matrix6d::Zero());
    world_sequence_ = frame.header.sequence;
    now_.trusted = true;
    now_.begins_map = true;
    now_.flags |= OdometryResult::kReinitialized;
    renew_map(frame);
}

/// What the next frames need of a registered one.
void Odometry::remember(const Frame& frame) {
    if (const auto change = registered_motion_.see_scan(filter_.state(), frame.header.stamp_ns)) {
        imu_.see_motion(*change, filter_, frame);
    }
    usual_.see(now_.quality);
    registration_.set_target(registration_.scan(), filter_.T_world_sensor());
}

}  // namespace dlod
