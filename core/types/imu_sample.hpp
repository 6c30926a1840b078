#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace dlod {

inline constexpr double kStandardGravity_mps2 = 9.80665;

/// One reading of the sensor's IMU, in the IMU frame (SensorModel::T_sensor_imu turns it into the sensor's).
struct ImuSample {
    std::int64_t stamp_ns = 0;                                    ///< sensor clock, as the columns
    Eigen::Vector3f acceleration_mps2 = Eigen::Vector3f::Zero();  ///< specific force: +g upwards at rest
    Eigen::Vector3f angular_velocity_radps = Eigen::Vector3f::Zero();
};

}  // namespace dlod
