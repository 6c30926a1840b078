// Pose and motion of the IMU's body, and how a reading of the IMU carries them on.
#pragma once

#include <Eigen/Geometry>

#include "core/odometry/imu_buffer.hpp"

namespace dlod {

struct MotionState {
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< world from body
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();          ///< of the body, world
    Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();        ///< of the body, world
    Eigen::Vector3d rate_radps =
        Eigen::Vector3d::Zero();  ///< body: bias of the gyroscope, or without IMU the angular velocity
    Eigen::Vector3d accelerometer_bias_mps2 = Eigen::Vector3d::Zero();
    Eigen::Vector3d gravity_mps2 = Eigen::Vector3d(0.0, 0.0, -kStandardGravity_mps2);
};

/// Moves the state by dt, which may be negative, at a constant turn rate (body) and acceleration (world).
void advance(MotionState& state, const Eigen::Vector3d& rate_radps, const Eigen::Vector3d& acceleration_mps2,
             double dt_s);
/// The same as the IMU has felt it in the middle of that time; the state's rate is the gyroscope's bias.
void advance(MotionState& state, const ImuBuffer::Reading& middle, double dt_s);

}  // namespace dlod
