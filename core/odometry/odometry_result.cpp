// What is said of a frame: pose, covariance, validity, deskewed cloud, residuals.
#include <Eigen/Eigenvalues>

#include "core/odometry/deskew.hpp"
#include "core/odometry/odometry.hpp"

namespace dlod {
namespace {

// A predicted pose is valid for this long at most.
constexpr double kMaxPrediction_s = 1.0;

}  // namespace

void Odometry::write_result(Frame& frame) {
    OdometryResult& out = frame.odometry;
    out.T_world_sensor = filter_.T_world_sensor();
    out.linear_velocity_mps = filter_.sensor_linear_velocity();
    out.angular_velocity_radps = filter_.sensor_angular_velocity();
    out.imu = filter_.imu_correction();
    out.iterations = registration_.iterations();
    out.correspondences = static_cast<int>(now_.registered ? registration_.matches().count : 0);
    out.void_scan_ns = now_.void_scan_ns;
    out.flags = now_.flags | (filter_.uses_imu() ? OdometryResult::kImuUsed : 0U) |
                (now_.registered ? 0U : OdometryResult::kPredictedOnly);
    const Matrix6d deviation = filter_.pose_covariance();
    const bool usable = is_usable(deviation);
    const bool shown = sure_ && now_.fits;
    out.valid = usable && shown;
    out.in_doubt = usable && !shown;

    PlacedScan& scan = registration_.scan();
    deskew(sensor_, scan.motion(), frame);
    scan.place_all();
    registration_.residuals(keyframes_.submap(), frame.prepared.ground, out);

    const Eigen::Vector3d position_m = out.T_world_sensor.translation();
    const double range_m = spaciousness_.see(frame.prepared.points);
    const Observability::Directions held = registration_.held().observability().directions();
    if (now_.registered) uncertainty_.see_map(keyframes_, position_m, held);
    out.covariance = now_.registered && !now_.begins_map
                         ? uncertainty_.of_registered(keyframes_.newness(position_m, range_m), deviation, held)
                         : uncertainty_.of_predicted(deviation);
    // A first scan has been deskewed without its velocity: it is no keyframe.
    out.keyframe =
        now_.registered && now_.trusted && !bootstrap_.pending() && keyframes_.is_due(out.T_world_sensor, range_m);
    if (!out.keyframe) return;
    keyframes_.announce(out.T_world_sensor, out.covariance);
    write_keyframe_points(frame);
}

/// @param deviation covariance of the pose against the local map
bool Odometry::is_usable(const Matrix6d& deviation) const {
    const bool is_followed = now_.registered || registered_motion_.since_s(filter_.stamp_ns()) < kMaxPrediction_s;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> position(deviation.topLeftCorner<3, 3>(),
                                                                  Eigen::EigenvaluesOnly);
    return now_.trusted && is_followed && position.eigenvalues()[2] < config_.max_deviation_m * config_.max_deviation_m;
}

/// The placed points as seen from the sensor at the stamp.
void Odometry::write_keyframe_points(Frame& frame) const {
    const PlacedScan& scan = registration_.scan();
    const PlacedPoints& placed = scan.placed();
    auto& out = frame.odometry.keyframe_points;
    for (auto& values : out) {
        values.reserve(frame.prepared.points.pixel.capacity());
        values.resize(placed.size());
    }
    const Eigen::Isometry3f T =
        (frame.odometry.T_world_sensor.inverse() * Eigen::Translation3d(scan.origin_m())).cast<float>();
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const Eigen::Vector3f p = T * Eigen::Vector3f(placed.x[i], placed.y[i], placed.z[i]);
        const Eigen::Vector3f n = T.linear() * Eigen::Vector3f(placed.nx[i], placed.ny[i], placed.nz[i]);
        for (Eigen::Index k = 0; k < 3; ++k) {
            out[static_cast<std::size_t>(k)][i] = p[k];
            out[static_cast<std::size_t>(k) + 3][i] = n[k];
        }
    }
}

/// Nothing of whichever frame was here before remains: all runs give the same.
void Odometry::write_nothing(Frame& frame) const {
    OdometryResult& out = frame.odometry;
    out.T_world_sensor = started_ ? filter_.T_world_sensor() : Eigen::Isometry3d::Identity();
    out.linear_velocity_mps.setZero();
    out.angular_velocity_radps.setZero();
    out.covariance.setZero();
    out.imu = filter_.imu_correction();
    out.valid = false;
    out.in_doubt = false;
    out.keyframe = false;
    out.void_scan_ns.reset();
    out.flags = OdometryResult::kPredictedOnly;
    out.iterations = 0;
    out.correspondences = 0;
    out.residual_pixel.clear();
    out.residual_m.clear();
    for (auto* image : {&out.x, &out.y, &out.z}) image->fill(0.0F);
}

}  // namespace dlod
