#include "core/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/map/keyframe_cloud.hpp"
#include "core/odometry/deskew.hpp"
#include "core/odometry/moving_points.hpp"

namespace dlod {
namespace {

constexpr double kStopTranslation_m = 1e-3;
constexpr double kStopRotation_rad = 1e-4;
constexpr double kMaxSweep_s = 0.5;
// Fewer matches than this do not make a pose.
constexpr std::size_t kMinMatches = 60;
constexpr int kBootstrapPasses = 3;
constexpr int kBootstrapIterations = 10;
constexpr double kBootstrapWidening = 3.0;
// A predicted pose is valid as long as its standard deviation stays below this.
constexpr double kMaxDeviation_m = 0.3;

bool converged(const MotionFilter::Step& step) {
    return step.translation_m < kStopTranslation_m && step.rotation_rad < kStopRotation_rad;
}

}  // namespace

struct Odometry::State {
    State(const SensorModel& sensor_model, const OdometryConfig& configuration);

    void process(Frame& frame, const OdometryFeedback* feedback);

  private:
    void apply(const OdometryFeedback& feedback);
    void start(Frame& frame);
    void bootstrap(const Frame& frame);
    bool register_frame(const Frame& frame, int first_stage_iterations, double widening);
    void choose_origin();
    void update_sweep(const Frame& frame);
    void place_target(const PointSelection& points, const SweepMotion& sweep, const Eigen::Vector3d& sweep_origin_m,
                      const Eigen::Isometry3d& T_world_sensor);
    void write_result(Frame& frame, bool registered);
    Eigen::Vector3d gravity_from_accelerometer(const Frame& frame) const;
    double median_range(const PointSelection& points);

    SensorModel sensor;
    OdometryConfig config;
    ImuBuffer imu;
    MotionFilter filter;
    KeyframeDatabase keyframes;
    ScanToScan scan_to_scan;
    ScanToSubmap scan_to_submap;
    MovingPoints moving;

    std::uint64_t frames = 0;
    std::optional<MotionFilter> first_filter;  ///< at the stamp of the first frame, until the second one has come
    PointSelection first_points;
    SweepMotion first_motion;
    Eigen::Isometry3d T_world_target = Eigen::Isometry3d::Identity();  ///< pose of the first stage's target scan

    // Scratch of one frame.
    SweepMotion motion;
    VoxelIndex origin;
    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
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
      scan_to_submap(configuration.scan_to_submap) {}

void Odometry::State::process(Frame& frame, const OdometryFeedback* feedback) {
    if (feedback != nullptr) apply(*feedback);
    imu.add(frame.imu);
    const PointSelection& points = frame.prepared.points;
    excluded.assign(points.size(), 0);
    iterations = 0;
    if (frames == 0) {
        if (!frame.header.usable) {
            frame.odometry.valid = false;
            return;
        }
        start(frame);
        write_result(frame, true);
    } else {
        filter.predict(frame.header.stamp_ns);
        choose_origin();
        update_sweep(frame);
        bool registered = false;
        if (frame.header.usable) {
            keyframes.update_submap(filter.state().position_m);
            moving.mark(points, motion, origin_m, frame.header.stamp_ns, excluded);
            if (first_filter) {
                bootstrap(frame);
                registered = matches.count >= kMinMatches;
            } else {
                registered = register_frame(frame, config.scan_to_scan.iterations, 1.0);
            }
        }
        update_sweep(frame);
        write_result(frame, registered);
    }
    if (frame.header.usable) place_target(points, motion, origin_m, filter.T_world_sensor());
    ++frames;
}

void Odometry::State::apply(const OdometryFeedback& feedback) {
    for (const OrientedBox& box : feedback.cleared) keyframes.remove_points(box);
    if (feedback.has_keyframe) keyframes.add(feedback.keyframe);
    moving.set(feedback.moving, feedback.stamp_ns);
}

Eigen::Vector3d Odometry::State::gravity_from_accelerometer(const Frame& frame) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const ImuSample& sample : frame.imu) sum += sample.acceleration_mps2.cast<double>();
    return sum.norm() > 1.0 ? Eigen::Vector3d(sensor.T_sensor_imu.linear() * sum.normalized())
                            : Eigen::Vector3d::UnitZ();
}

void Odometry::State::start(Frame& frame) {
    const bool with_imu = config.use_imu && !imu.empty();
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    if (with_imu) {
        // Level, with the sensor's x axis at yaw 0.
        const Eigen::Vector3d up = gravity_from_accelerometer(frame);
        const Eigen::Vector3d left = up.cross(Eigen::Vector3d::UnitX()).normalized();
        Eigen::Matrix3d R;
        R << left.cross(up).transpose(), left.transpose(), up.transpose();
        T_world_sensor.linear() = R;
    }
    filter.initialize(T_world_sensor, Eigen::Vector3d(0.0, 0.0, -9.80665), frame.header.stamp_ns,
                      with_imu ? &imu : nullptr);
    choose_origin();
    update_sweep(frame);
    first_filter = filter;
    first_points = frame.prepared.points;
    first_motion = motion;
}

/// The first scan could not be deskewed for its velocity: now that the second one tells it, do both again.
void Odometry::State::bootstrap(const Frame& frame) {
    for (int pass = 0; pass < kBootstrapPasses; ++pass) {
        const Eigen::Vector3d predicted = filter.state().velocity_mps;
        if (!register_frame(frame, kBootstrapIterations, pass == 0 ? kBootstrapWidening : 1.0)) break;
        if (pass + 1 == kBootstrapPasses) break;
        MotionFilter again = *first_filter;
        again.set_motion(again.state().velocity_mps + filter.state().velocity_mps - predicted,
                         filter.state().rate_radps);
        again.sweep(static_cast<double>(first_motion.duration_s), Eigen::Vector3d::Zero(), first_motion);
        place_target(first_points, first_motion, Eigen::Vector3d::Zero(), again.T_world_sensor());
        first_filter = again;
        filter = again;
        filter.predict(frame.header.stamp_ns);
        update_sweep(frame);
    }
    first_filter.reset();
    first_points = PointSelection{};
}

/// Both stages: the first for the guess, the second for the pose. The filter's prediction is the prior of either.
bool Odometry::State::register_frame(const Frame& frame, int first_stage_iterations, double widening) {
    const PointSelection& points = frame.prepared.points;
    filter.begin_update();
    const auto iterate = [&](int most, auto&& match) {
        for (int i = 0; i < most; ++i) {
            if (i > 0) update_sweep(frame);
            match(i);
            if (matches.count < kMinMatches) return;
            accumulate(matches, equations);
            ++iterations;
            if (converged(filter.step(equations))) return;
        }
    };
    const Eigen::Isometry3f T_target_local = (T_world_target.inverse() * Eigen::Translation3d(origin_m)).cast<float>();
    iterate(first_stage_iterations,
            [&](int) { scan_to_scan.match(points, excluded, motion, T_target_local, widening, matches); });
    update_sweep(frame);
    iterate(config.scan_to_submap.iterations, [&](int i) {
        scan_to_submap.match(points, excluded, motion, keyframes.submap(), origin, i == 0 ? 2.0 * widening : 1.0,
                             matches);
    });
    if (matches.count < kMinMatches) {
        filter.discard_update();
        return false;
    }
    filter.finish_update();
    return true;
}

/// The motion over the sweep as the filter sees it now.
void Odometry::State::update_sweep(const Frame& frame) {
    const double duration = static_cast<double>(frame.header.stamp_ns - frame.header.first_stamp_ns) * 1e-9;
    filter.sweep(std::clamp(duration, 1e-3, kMaxSweep_s), origin_m, motion);
}

/// The local frame of this scan: the world moved to a corner of the voxels near the sensor.
void Odometry::State::choose_origin() {
    const double side = keyframes.submap().voxel_m();
    const Eigen::Vector3d p = filter.state().position_m / side;
    origin = {static_cast<std::int32_t>(std::floor(p.x())), static_cast<std::int32_t>(std::floor(p.y())),
              static_cast<std::int32_t>(std::floor(p.z()))};
    origin_m = side * Eigen::Vector3d(origin.x, origin.y, origin.z);
}

/// Makes a scan the target of the first stage, and of the second too as long as there are no keyframes.
void Odometry::State::place_target(const PointSelection& points, const SweepMotion& sweep,
                                   const Eigen::Vector3d& sweep_origin_m, const Eigen::Isometry3d& T_world_sensor) {
    T_world_target = T_world_sensor;
    const Eigen::Isometry3d T_local_sensor = Eigen::Translation3d(-sweep_origin_m) * T_world_sensor;
    scan_to_scan.set_target(points, excluded, sweep, T_local_sensor.inverse().cast<float>());
    if (frames <= 1 && keyframes.size() == 0 && first_filter) {
        KeyframeCloud cloud;
        build_keyframe_cloud(points, sweep, sweep_origin_m, cloud);
        keyframes.set_provisional(cloud);
    }
}

void Odometry::State::write_result(Frame& frame, bool registered) {
    OdometryResult& out = frame.odometry;
    out.T_world_sensor = filter.T_world_sensor();
    out.linear_velocity_mps = filter.sensor_linear_velocity();
    out.angular_velocity_radps = filter.sensor_angular_velocity();
    out.covariance = filter.pose_covariance();
    out.gravity_mps2 = filter.state().gravity_mps2;
    out.iterations = iterations;
    out.correspondences = static_cast<int>(registered ? matches.count : 0);
    out.flags =
        (filter.uses_imu() ? OdometryResult::kImuUsed : 0U) | (registered ? 0U : OdometryResult::kPredictedOnly);
    out.valid = registered || out.covariance.diagonal().head<3>().sum() < kMaxDeviation_m * kMaxDeviation_m;
    deskew(sensor, motion, frame);
    scan_to_submap.residuals(frame.prepared.points, motion, keyframes.submap(), origin, out.residual_pixel,
                             out.residual_m);
    // The first frame has been deskewed without its velocity: it is no keyframe.
    out.keyframe =
        registered && frames > 0 && keyframes.is_due(out.T_world_sensor, median_range(frame.prepared.points));
    if (out.keyframe) keyframes.announce(out.T_world_sensor);
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
