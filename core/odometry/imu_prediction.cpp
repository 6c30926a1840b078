#include "core/odometry/imu_prediction.hpp"

#include <algorithm>
#include <span>

namespace dlod {
namespace {

constexpr std::int64_t kStep_ns = 10'000'000;

}  // namespace

ImuPrediction::ImuPrediction(const Eigen::Isometry3d& T_sensor_imu, const MotionFilterConfig& config)
    : T_sensor_imu_(T_sensor_imu), gyro_noise_(config.gyro_noise), accelerometer_noise_(config.accelerometer_noise) {}

void ImuPrediction::begin(std::int64_t stamp_ns, const SensorMotion& motion, const ImuCorrection& correction) {
    const Eigen::Isometry3d T_world_imu = motion.T_world_sensor * T_sensor_imu_;
    const Eigen::Vector3d lever = motion.angular_velocity_radps.cross(T_sensor_imu_.translation());
    state_.rotation = Eigen::Quaterniond(T_world_imu.linear());
    state_.position_m = T_world_imu.translation();
    state_.velocity_mps = motion.T_world_sensor.linear() * (motion.linear_velocity_mps + lever);
    state_.rate_radps = correction.gyro_bias_radps;
    state_.accelerometer_bias_mps2 = correction.accelerometer_bias_mps2;
    state_.gravity_mps2 = correction.gravity_mps2;
    begin_covariance_ = motion.covariance;
    velocity_covariance_ = correction.velocity_covariance;
    begin_ns_ = stamp_ns;
    stamp_ns_ = stamp_ns;
    known_ = true;
    carry_on();
}

void ImuPrediction::add(const ImuSample& sample) {
    readings_.add(std::span(&sample, 1));
    carry_on();
}

void ImuPrediction::carry_on() {
    if (!known_) return;
    while (stamp_ns_ < readings_.newest_ns()) {
        const std::int64_t target_ns = std::min(stamp_ns_ + kStep_ns, readings_.newest_ns());
        const std::int64_t middle_ns = stamp_ns_ + (target_ns - stamp_ns_) / 2;
        if (target_ns - begin_ns_ > kMost_ns || readings_.is_silent_at(middle_ns)) {
            end();
            return;
        }
        advance(state_, readings_.at(middle_ns), 1e-9 * static_cast<double>(target_ns - stamp_ns_));
        stamp_ns_ = target_ns;
    }
}

std::optional<SensorMotion> ImuPrediction::motion() const {
    if (!known_ || stamp_ns_ == begin_ns_) return std::nullopt;
    const Eigen::Isometry3d T_imu_sensor = T_sensor_imu_.inverse();
    const Eigen::Vector3d rate = readings_.at(stamp_ns_).angular_velocity_radps - state_.rate_radps;
    SensorMotion motion;
    motion.T_world_sensor = make_pose(state_.rotation, state_.position_m) * T_imu_sensor;
    motion.linear_velocity_mps = T_sensor_imu_.linear() * (state_.rotation.conjugate() * state_.velocity_mps +
                                                           rate.cross(T_imu_sensor.translation()));
    motion.angular_velocity_radps = T_sensor_imu_.linear() * rate;
    const double dt = 1e-9 * static_cast<double>(stamp_ns_ - begin_ns_);
    motion.covariance = begin_covariance_;
    motion.covariance.topLeftCorner<3, 3>() += dt * dt * velocity_covariance_;
    motion.covariance.diagonal().head<3>().array() += accelerometer_noise_ * accelerometer_noise_ * dt * dt * dt / 3.0;
    motion.covariance.diagonal().tail<3>().array() += gyro_noise_ * gyro_noise_ * dt;
    return motion;
}

}  // namespace dlod
