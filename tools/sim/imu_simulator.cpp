#include "tools/sim/imu_simulator.hpp"

#include "core/types/lie.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kAccelerationNoise_mps2 = 0.03;
constexpr double kGyroscopeNoise_radps = 0.003;
constexpr std::uint64_t kStream = 0x1A0;

}  // namespace

ImuSimulator::ImuSimulator(const RobotMotion& robot, const SensorModel& sensor, std::uint64_t seed, bool noise)
    : robot_(robot), T_sensor_imu_(sensor.T_sensor_imu), seed_(seed), noise_(noise) {
    if (!noise) return;
    Random random(seed, kStream);
    for (int k = 0; k < 3; ++k) {
        acceleration_bias_[k] = 0.03 * random.normal();
        gyroscope_bias_[k] = 0.002 * random.normal();
    }
}

ImuReading ImuSimulator::truth(double t) const {
    constexpr double kStep_s = 1e-3;
    const auto imu_at = [&](double time) { return Eigen::Isometry3d(robot_.T_world_sensor(time) * T_sensor_imu_); };
    const Eigen::Isometry3d before = imu_at(t - kStep_s);
    const Eigen::Isometry3d now = imu_at(t);
    const Eigen::Isometry3d after = imu_at(t + kStep_s);
    const Vec3 acceleration =
        (before.translation() - 2.0 * now.translation() + after.translation()) / (kStep_s * kStep_s);
    ImuReading reading;
    reading.acceleration_mps2 = now.linear().transpose() * (acceleration + Vec3(0.0, 0.0, kStandardGravity_mps2));
    const Eigen::Matrix3d turn = before.linear().transpose() * after.linear();
    reading.angular_velocity_radps = so3_log(Eigen::Quaterniond(turn)) / (2.0 * kStep_s);
    return reading;
}

ImuReading ImuSimulator::measured(int index) const {
    ImuReading reading = truth(time_s(index));
    if (!noise_) return reading;
    Random random(seed_, kStream + 1, static_cast<std::uint64_t>(index));
    for (int k = 0; k < 3; ++k) {
        reading.acceleration_mps2[k] += acceleration_bias_[k] + kAccelerationNoise_mps2 * random.normal();
        reading.angular_velocity_radps[k] += gyroscope_bias_[k] + kGyroscopeNoise_radps * random.normal();
    }
    return reading;
}

}  // namespace dlod::tools::sim
