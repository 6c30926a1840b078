#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>

#include "core/map/keyframe_cloud.hpp"
#include "core/odometry/deskew.hpp"
#include "core/odometry/imu_monitor.hpp"
#include "core/odometry/moving_points.hpp"
#include "core/registration/observability.hpp"

namespace dlod {
namespace {

constexpr double kStopTranslation_m = 1e-3;
constexpr double kStopRotation_rad = 1e-4;
constexpr double kMaxSweep_s = 0.5;
// Fewer matches than this do not make a pose.
constexpr std::size_t kMinMatches = 60;
// Nor do matches of fewer than this share of the points, or matches of which fewer than that share lie on their planes.
constexpr double kMinMatchedShare = 0.1;
constexpr double kMinNearShare = 0.5;
constexpr double kNear_m = 0.1;
// With fewer matches near their planes than this share of the usual the IMU is suspected, and blamed if without it
// there are so many times more.
constexpr double kPoorShare = 0.6;
constexpr double kClearlyBetter = 1.2;
constexpr double kNearSmoothing = 0.2;
constexpr int kBootstrapPasses = 5;
constexpr int kBootstrapIterations = 10;
// Gates open as the prediction's standard deviation grows beyond this.
constexpr double kSureDeviation_m = 0.1;
constexpr double kMaxWidening = 3.0;
// A predicted pose is valid for this long, and as long as its standard deviation stays below this.
constexpr double kMaxPrediction_s = 1.0;
constexpr double kMaxDeviation_m = 0.3;
// After so long without a registration the map is given up.
constexpr double kLost_s = 2.0;
// Without a scan for longer than this there is no prediction worth the name.
constexpr double kMaxGap_s = 5.0;
constexpr double kStandardGravity_mps2 = 9.80665;

bool converged(const MotionFilter::Step& step) {
    return step.translation_m < kStopTranslation_m && step.rotation_rad < kStopRotation_rad;
}

}  // namespace

struct Odometry::State {
    State(const SensorModel& sensor_model, const OdometryConfig& configuration);

    void process(Frame& frame, const OdometryFeedback* feedback);

  private:
    void apply(const OdometryFeedback& feedback);
    void start(const Frame& frame, const Eigen::Isometry3d& T_world_sensor);
    void restart(const Frame& frame);
    bool estimate(const Frame& frame);
    void choose_motion_model(const Frame& frame);
    bool imu_is_consistent();
    void retry_without_imu(const Frame& frame, const MotionFilter& before);
    void use_constant_velocity();
    void bootstrap(const Frame& frame);
    void register_frame(const Frame& frame, int first_stage_iterations, double widening);
    void register_widely(const Frame& frame);
    void place_provisional();
    bool is_trustworthy();
    void choose_origin();
    void update_sweep(const Frame& frame);
    void place_target(const PointSelection& points, std::span<const std::uint8_t> without,
                      const Eigen::Isometry3d& T_world_sensor);
    void see_turn(std::int64_t stamp_ns);
    void write_result(Frame& frame);
    void write_nothing(Frame& frame) const;
    Eigen::Vector3d mean_force(const Frame& frame) const;
    double median_range(const PointSelection& points);

    SensorModel sensor;
    OdometryConfig config;
    ImuBuffer imu;
    ImuMonitor monitor;
    MotionFilter filter;
    KeyframeDatabase keyframes;
    ScanToScan scan_to_scan;
    ScanToSubmap scan_to_submap;
    MovingPoints moving;

    bool started = false;
    std::uint64_t map_sequence = 0;  ///< of the frame that the map began with
    bool bootstrapping = false;      ///< the map is one scan that has not been deskewed for its velocity
    MotionFilter first_filter;       ///< while bootstrapping: at the stamp of that scan
    PointSelection first_points;     ///< while bootstrapping: of that scan
    double first_duration_s = 0.0;   ///< while bootstrapping: of that scan
    std::int64_t last_registered_ns = 0;
    Eigen::Isometry3d T_world_target = Eigen::Isometry3d::Identity();     ///< pose of the first stage's target scan
    std::int64_t target_ns = 0;                                           ///< its stamp
    Eigen::Quaterniond target_rotation = Eigen::Quaterniond::Identity();  ///< of the body
    Eigen::Vector3d lidar_rate_radps = Eigen::Vector3d::Zero();  ///< body, between the last two registered scans

    // Of the present frame.
    std::uint32_t flags = 0;
    bool registered = false;
    bool trusted = true;  ///< false: what this frame gives is not to be used
    SweepMotion motion;
    PlacedPoints placed;  ///< the frame's points after that motion
    VoxelIndex origin;
    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
    std::size_t candidates = 0;  ///< points that might have found a counterpart
    std::size_t near = 0;        ///< matches that lie on their planes
    double usual_near = 0.0;     ///< the same over the last frames
    PlaneMatches matches;
    NormalEquations equations;
    AlignedVector<std::uint8_t> excluded;
    std::vector<float> ranges;
    double spaciousness_m = 0.0;
    int iterations = 0;
};

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
    excluded.assign(frame.prepared.points.size(), 0);
    flags = 0;
    iterations = 0;
    registered = false;
    trusted = true;
    const bool goes_back = started && frame.header.stamp_ns <= filter.stamp_ns();
    const bool lost = started && static_cast<double>(frame.header.stamp_ns - last_registered_ns) * 1e-9 > kLost_s;
    if (!started) {
        if (frame.header.usable) start(frame, Eigen::Isometry3d::Identity());
    } else if (goes_back) {
        restart(frame);
    } else if (static_cast<double>(frame.header.stamp_ns - filter.stamp_ns()) * 1e-9 > kMaxGap_s) {
        // The sensor was away, or its clock has jumped: whatever a prediction over such a time gave would be invented.
        restart(frame);
        trusted = false;
    } else {
        choose_motion_model(frame);
        const MotionFilter before = filter;
        registered = estimate(frame);
        if (frame.header.usable && filter.uses_imu() && !bootstrapping) {
            const bool poor = !registered || static_cast<double>(near) < kPoorShare * usual_near;
            if (poor || !imu_is_consistent()) retry_without_imu(frame, before);
        }
        bootstrapping = bootstrapping && !registered;
        if (!registered && lost && frame.header.usable) restart(frame);
    }
    if (!started) {
        write_nothing(frame);
        return;
    }
    update_sweep(frame);
    write_result(frame);
    if (registered) {
        see_turn(frame.header.stamp_ns);
        usual_near += kNearSmoothing * (static_cast<double>(near) - usual_near);
        last_registered_ns = frame.header.stamp_ns;
        place_target(frame.prepared.points, excluded, filter.T_world_sensor());
    }
}

/// The prediction by the IMU may have misled the registration: does the lidar alone do better?
void Odometry::State::retry_without_imu(const Frame& frame, const MotionFilter& before) {
    const MotionFilter with_imu = filter;
    const bool was_registered = registered;
    const double was_near = static_cast<double>(near);
    filter = before;
    use_constant_velocity();
    registered = estimate(frame);
    if (registered && (!was_registered || static_cast<double>(near) > kClearlyBetter * was_near)) {
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
        filter.set_gravity(-kStandardGravity_mps2 * (filter.state().rotation * mean_force(frame)));
    }
    if (monitor.faulty()) flags |= OdometryResult::kImuFaulty;
}

bool Odometry::State::estimate(const Frame& frame) {
    filter.predict(frame.header.stamp_ns);
    choose_origin();
    update_sweep(frame);
    if (!frame.header.usable) return false;
    const PointSelection& points = frame.prepared.points;
    keyframes.update_submap(filter.state().position_m);
    moving.mark(placed, origin_m, frame.header.stamp_ns, excluded);
    candidates = 0;
    for (std::size_t i = 0; i < points.size(); ++i) candidates += points.planarity[i] > 0.0F && !excluded[i] ? 1 : 0;
    if (bootstrapping) {
        bootstrap(frame);
    } else {
        const double deviation = std::sqrt(filter.pose_covariance().diagonal().head<3>().sum());
        const double widening = std::clamp(deviation / kSureDeviation_m, 1.0, kMaxWidening);
        register_frame(frame, widening > 1.0 ? kBootstrapIterations : config.scan_to_scan.iterations, widening);
    }
    if (is_trustworthy()) {
        filter.finish_update();
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

/// Tells the monitor how far off the prediction by the IMU was.
bool Odometry::State::imu_is_consistent() {
    const MotionFilter::Vector correction = filter.correction();
    const MotionFilter::Vector deviation = filter.prior_deviation();
    return monitor.see_correction(correction.segment<3>(3), deviation.segment<3>(3).norm(), correction.segment<3>(6),
                                  deviation.segment<3>(6).norm());
}

/// Direction of the mean specific force over the frame, body axes: up, when at rest.
Eigen::Vector3d Odometry::State::mean_force(const Frame& frame) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const ImuSample& sample : frame.imu) {
        if (sample.acceleration_mps2.allFinite()) sum += sample.acceleration_mps2.cast<double>();
    }
    return sum.norm() > 1.0 ? Eigen::Vector3d(sum.normalized()) : Eigen::Vector3d::UnitZ();
}

/// Begins a map with this scan. Nothing is known of its velocity yet: the next scan will tell.
void Odometry::State::start(const Frame& frame, const Eigen::Isometry3d& T_world_sensor) {
    const bool with_imu = monitor.usable() && !imu.empty();
    Eigen::Isometry3d T = T_world_sensor;
    if (!started && with_imu) {
        // Level, with the sensor's x axis at yaw 0.
        const Eigen::Vector3d up = sensor.T_sensor_imu.linear() * mean_force(frame);
        const Eigen::Vector3d left = up.cross(Eigen::Vector3d::UnitX()).normalized();
        Eigen::Matrix3d R;
        R << left.cross(up).transpose(), left.transpose(), up.transpose();
        T.linear() = R;
    }
    const Eigen::Vector3d gravity =
        started ? filter.state().gravity_mps2 : Eigen::Vector3d(0.0, 0.0, -kStandardGravity_mps2);
    filter.initialize(T, gravity, frame.header.stamp_ns, with_imu ? &imu : nullptr);
    if (monitor.faulty()) flags |= OdometryResult::kImuFaulty;
    started = true;
    map_sequence = frame.header.sequence;
    bootstrapping = true;
    registered = true;
    choose_origin();
    update_sweep(frame);
    first_filter = filter;
    first_points = frame.prepared.points;
    first_duration_s = static_cast<double>(motion.duration_s);
    place_provisional();
}

/// Goes on with a new map from where the robot is believed to be: it is lost, or the sensor's clock has jumped back.
void Odometry::State::restart(const Frame& frame) {
    flags |= OdometryResult::kReinitialized;
    keyframes.clear();
    if (frame.header.stamp_ns <= filter.stamp_ns() ||
        static_cast<double>(frame.header.stamp_ns - filter.stamp_ns()) * 1e-9 > kMaxGap_s) {
        imu.clear();
        imu.add(frame.imu);
    }
    start(frame, filter.T_world_sensor());
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
    Observability observability;
    const auto iterate = [&](int most, auto&& match) {
        for (int i = 0; i < most; ++i) {
            if (i > 0) update_sweep(frame);
            match(i);
            if (matches.count < kMinMatches) return;
            accumulate(matches, equations);
            if (i == 0) observability = observe(matches, equations);
            project(observability, equations);
            ++iterations;
            if (converged(filter.step(equations))) return;
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
    if (observability.unobservable > 0) flags |= OdometryResult::kDegenerate;
}

/// The motion over the sweep as the filter sees it now, and the points after it.
void Odometry::State::update_sweep(const Frame& frame) {
    const double duration = static_cast<double>(frame.header.stamp_ns - frame.header.first_stamp_ns) * 1e-9;
    filter.sweep(std::clamp(duration, 1e-3, kMaxSweep_s), origin_m, motion);
    place(frame.prepared.points, motion, placed);
}

/// The local frame of this scan: the world moved to a corner of the voxels near the sensor.
void Odometry::State::choose_origin() {
    const double side = keyframes.submap().voxel_m();
    const Eigen::Vector3d p = filter.state().position_m / side;
    origin = {static_cast<std::int32_t>(std::floor(p.x())), static_cast<std::int32_t>(std::floor(p.y())),
              static_cast<std::int32_t>(std::floor(p.z()))};
    origin_m = side * Eigen::Vector3d(origin.x, origin.y, origin.z);
}

/// The turn since the last registered scan after the lidar, beside the gyroscope's.
void Odometry::State::see_turn(std::int64_t stamp_ns) {
    const double dt = static_cast<double>(stamp_ns - target_ns) * 1e-9;
    const Eigen::Quaterniond rotation = filter.state().rotation;
    if (target_ns != 0 && dt > 0.0 && dt < kMaxSweep_s) {
        const Eigen::Vector3d turn = so3_log(target_rotation.conjugate() * rotation);
        lidar_rate_radps = turn / dt;
        if (!imu.empty()) monitor.see_turns(imu.turn(target_ns, stamp_ns), turn);
    }
    target_ns = stamp_ns;
    target_rotation = rotation;
}

/// Makes the placed points the target of the first stage.
void Odometry::State::place_target(const PointSelection& points, std::span<const std::uint8_t> without,
                                   const Eigen::Isometry3d& T_world_sensor) {
    T_world_target = T_world_sensor;
    const Eigen::Isometry3d T_local_sensor = Eigen::Translation3d(-origin_m) * T_world_sensor;
    scan_to_scan.set_target(points, without, placed, T_local_sensor.inverse().cast<float>());
}

void Odometry::State::write_result(Frame& frame) {
    OdometryResult& out = frame.odometry;
    const double since_registered = static_cast<double>(frame.header.stamp_ns - last_registered_ns) * 1e-9;
    out.T_world_sensor = filter.T_world_sensor();
    out.linear_velocity_mps = filter.sensor_linear_velocity();
    out.angular_velocity_radps = filter.sensor_angular_velocity();
    out.covariance = filter.pose_covariance() + keyframes.anchor_covariance(out.T_world_sensor.translation());
    out.gravity_mps2 = filter.state().gravity_mps2;
    out.iterations = iterations;
    out.correspondences = static_cast<int>(registered ? matches.count : 0);
    out.flags = flags | (filter.uses_imu() ? OdometryResult::kImuUsed : 0U) |
                (registered ? 0U : OdometryResult::kPredictedOnly);
    out.valid = trusted && (registered || (since_registered < kMaxPrediction_s &&
                                           std::sqrt(out.covariance.diagonal().head<3>().sum()) < kMaxDeviation_m));
    deskew(sensor, motion, frame);
    scan_to_submap.residuals(frame.prepared.points, placed, keyframes.submap(), origin, out.residual_pixel,
                             out.residual_m);
    // A first scan has been deskewed without its velocity: it is no keyframe.
    out.keyframe =
        registered && !bootstrapping && keyframes.is_due(out.T_world_sensor, median_range(frame.prepared.points));
    if (out.keyframe) keyframes.announce(out.T_world_sensor, out.covariance);
}

/// Nothing of whichever frame was here before remains: all runs give the same.
void Odometry::State::write_nothing(Frame& frame) const {
    OdometryResult& out = frame.odometry;
    out.T_world_sensor = started ? filter.T_world_sensor() : Eigen::Isometry3d::Identity();
    out.linear_velocity_mps.setZero();
    out.angular_velocity_radps.setZero();
    out.covariance.setZero();
    out.gravity_mps2 = filter.state().gravity_mps2;
    out.valid = false;
    out.keyframe = false;
    out.flags = OdometryResult::kPredictedOnly;
    out.iterations = 0;
    out.correspondences = 0;
    out.residual_pixel.clear();
    out.residual_m.clear();
    for (auto* image : {&out.x, &out.y, &out.z}) image->fill(0.0F);
}

/// Spaciousness: median range of the selected points, smoothed over the frames.
double Odometry::State::median_range(const PointSelection& points) {
    ranges.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
        ranges.push_back(points.x[i] * points.x[i] + points.y[i] * points.y[i] + points.z[i] * points.z[i]);
    }
    if (ranges.empty()) return spaciousness_m;
    const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
    std::nth_element(ranges.begin(), middle, ranges.end());
    const double median = std::sqrt(static_cast<double>(*middle));
    spaciousness_m = spaciousness_m > 0.0 ? 0.9 * spaciousness_m + 0.1 * median : median;
    return spaciousness_m;
}

}  // namespace dlod
