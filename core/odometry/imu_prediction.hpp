// Where the robot is between frames: its last pose, carried on by the IMU's readings since then.
#pragma once

#include <cstdint>
#include <optional>

#include "core/odometry/imu_buffer.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/motion_state.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Readings may come before or after the pose that they are to carry on. Allocates nothing.
class ImuPrediction {
  public:
    /// A pose is carried on no farther: a planner had better stop than go on trusting it.
    static constexpr std::int64_t kMost_ns = 500'000'000;

    ImuPrediction(const Eigen::Isometry3d& T_sensor_imu, const MotionFilterConfig& config);

    /// From now on from this pose, and with the readings after its stamp that are known already.
    void begin(std::int64_t stamp_ns, const SensorMotion& motion, const ImuCorrection& correction);
    /// No pose to go on from.
    void end() { known_ = false; }
    void add(const ImuSample& sample);

    /// The motion that it has been carried on to; its covariance has grown by what velocity and readings leave
    /// uncertain. Nothing without a pose, without readings after it, or where it is too old.
    std::optional<SensorMotion> motion() const;
    /// Of that motion, sensor clock.
    std::int64_t stamp_ns() const { return stamp_ns_; }

  private:
    void carry_on();

    Eigen::Isometry3d T_sensor_imu_;
    double gyro_noise_;
    double accelerometer_noise_;
    ImuBuffer readings_;
    bool known_ = false;
    std::int64_t begin_ns_ = 0;
    Matrix6d begin_covariance_ = Matrix6d::Zero();
    Eigen::Matrix3d velocity_covariance_ = Eigen::Matrix3d::Zero();
    MotionState state_;  ///< of the IMU, at stamp_ns_
    std::int64_t stamp_ns_ = 0;
};

}  // namespace dlod
