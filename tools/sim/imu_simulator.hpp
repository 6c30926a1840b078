// What the sensor's IMU measures while the robot moves.
#pragma once

#include <cstdint>

#include "core/types/imu_sample.hpp"
#include "core/types/sensor_model.hpp"
#include "tools/sim/robot_motion.hpp"

namespace dlod::tools::sim {

struct ImuReading {
    Vec3 acceleration_mps2 = Vec3::Zero();  ///< specific force, IMU frame
    Vec3 angular_velocity_radps = Vec3::Zero();
};

class ImuSimulator {
  public:
    static constexpr double kPeriod_s = 0.01;
    static constexpr double kFirst_s = 0.0013;  ///< its clock runs beside the lidar's

    ImuSimulator(const RobotMotion& robot, const SensorModel& sensor, std::uint64_t seed, bool noise);

    /// Without errors, at a time since the drive's start.
    ImuReading truth(double t) const;
    /// Reading number `index`, with biases and noise.
    ImuReading measured(int index) const;
    static double time_s(int index) { return kFirst_s + index * kPeriod_s; }

    const Vec3& acceleration_bias() const { return acceleration_bias_; }
    const Vec3& gyroscope_bias() const { return gyroscope_bias_; }

  private:
    const RobotMotion& robot_;
    Eigen::Isometry3d T_sensor_imu_;
    std::uint64_t seed_;
    bool noise_;
    Vec3 acceleration_bias_ = Vec3::Zero();
    Vec3 gyroscope_bias_ = Vec3::Zero();
};

}  // namespace dlod::tools::sim
