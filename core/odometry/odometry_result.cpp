// What is said of a frame: pose, covariance, validity, deskewed cloud, residuals.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/odometry/deskew.hpp"
#include "core/odometry/odometry_state.hpp"

namespace dlod {
namespace {

// A predicted pose is valid for this long at most.
constexpr double kMaxPrediction_s = 1.0;
// Every n-th point serves for the median range.
constexpr std::size_t kMedianStep = 4;

}  // namespace

void Odometry::State::write_result(Frame& frame) {
    OdometryResult& out = frame.odometry;
    const double since_registered = static_cast<double>(frame.header.stamp_ns - last_registered_ns) * 1e-9;
    out.T_world_sensor = filter.T_world_sensor();
    out.linear_velocity_mps = filter.sensor_linear_velocity();
    out.angular_velocity_radps = filter.sensor_angular_velocity();
    const Matrix6d deviation = filter.pose_covariance();
    const double range_m = median_range(frame.prepared.points);
    out.covariance = covariance_in_world(out.T_world_sensor.translation(), range_m, deviation);
    out.gravity_mps2 = filter.state().gravity_mps2;
    out.iterations = iterations;
    out.correspondences = static_cast<int>(registered ? matches.count : 0);
    out.flags = flags | (filter.uses_imu() ? OdometryResult::kImuUsed : 0U) |
                (registered ? 0U : OdometryResult::kPredictedOnly);
    const double largest_variance =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(deviation.topLeftCorner<3, 3>(), Eigen::EigenvaluesOnly)
            .eigenvalues()[2];
    out.valid = trusted && (registered || since_registered < kMaxPrediction_s) &&
                largest_variance < config.max_deviation_m * config.max_deviation_m;
    deskew(sensor, motion, frame);
    place(frame.prepared.points, motion, placed);
    scan_to_submap.residuals(frame.prepared.points, placed, keyframes.submap(), origin, out.residual_pixel,
                             out.residual_m, &frame.prepared.ground);
    out.residual_cap_m = static_cast<float>(config.scan_to_submap.residual_cap_m);
    // A first scan has been deskewed without its velocity: it is no keyframe.
    out.void_scan_ns = void_scan_ns;
    out.keyframe = registered && trusted && !bootstrapping && keyframes.is_due(out.T_world_sensor, range_m);
    if (!out.keyframe) return;
    keyframes.announce(out.T_world_sensor, out.covariance);
    write_keyframe_points(frame);
}

/// The placed points as seen from the sensor at the stamp.
void Odometry::State::write_keyframe_points(Frame& frame) const {
    auto& out = frame.odometry.keyframe_points;
    for (auto& values : out) {
        values.reserve(frame.prepared.points.pixel.capacity());
        values.resize(placed.size());
    }
    const Eigen::Isometry3f T =
        (frame.odometry.T_world_sensor.inverse() * Eigen::Translation3d(origin_m)).cast<float>();
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const Eigen::Vector3f p = T * Eigen::Vector3f(placed.x[i], placed.y[i], placed.z[i]);
        const Eigen::Vector3f n = T.linear() * Eigen::Vector3f(placed.nx[i], placed.ny[i], placed.nz[i]);
        for (Eigen::Index k = 0; k < 3; ++k) {
            out[static_cast<std::size_t>(k)][i] = p[k];
            out[static_cast<std::size_t>(k) + 3][i] = n[k];
        }
    }
}

/// Covariance of the pose in the world: of the submap, of the registration with it, and of what is held or predicted.
/// The filter's own uncertainty serves for the latter only: it is made for a steady pose, not for an honest one.
Matrix6d Odometry::State::covariance_in_world(const Eigen::Vector3d& position_m, double range_m,
                                              const Matrix6d& deviation) {
    if (registered) update_anchor(position_m);
    if (!registered || just_started) return anchor + deviation;
    const Observability::Directions u = held.observability().directions();
    const Matrix6d along = u * u.transpose();
    return anchor + from_scan + keyframes.newness(position_m, range_m) * from_map + along * deviation * along;
}

/// How uncertain the submap is that the pose rests on. Along what is held that is still the one that was left behind:
/// what has happened since then is in the filter's own uncertainty.
void Odometry::State::update_anchor(const Eigen::Vector3d& position_m) {
    const Observability::Directions u = held.observability().directions();
    const Matrix6d along = u * u.transpose();
    const Matrix6d free = Matrix6d::Identity() - along;
    Matrix6d submap;
    if (keyframes.size() > 0) {
        submap = keyframes.anchor_covariance(position_m);
    } else {
        Matrix6d J = Matrix6d::Identity();
        J.block<3, 3>(0, 3) = -skew(position_m - start_position_m);
        submap = J * start_covariance * J.transpose();
    }
    anchor = (along * anchor * along + free * submap * free).eval();
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
    out.void_scan_ns.reset();
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
    ranges.reserve(points.pixel.capacity());
    for (std::size_t i = 0; i < points.size(); i += kMedianStep) {
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
