#include "daemon/publish/pose_publisher.hpp"

namespace dlod::daemon {
namespace {

std::int32_t flags_of(const OdometryResult& odometry) {
    static_assert(pose_t::IMU_USED == 2 * OdometryResult::kImuUsed &&
                  pose_t::IMU_FAULTY == 2 * OdometryResult::kImuFaulty &&
                  pose_t::RESTARTED == 2 * OdometryResult::kStarted);
    // The message's flags are the odometry's, moved up by one bit for VALID.
    return static_cast<std::int32_t>(odometry.flags << 1U) | (odometry.valid ? pose_t::VALID : 0);
}

}  // namespace

BaseMotion base_motion(const SensorMotion& sensor, const Eigen::Isometry3d& T_base_sensor) {
    BaseMotion motion;
    motion.T_odom_base = sensor.T_world_sensor * T_base_sensor.inverse();
    const Eigen::Vector3d lever = T_base_sensor.translation();
    motion.angular_velocity_radps = T_base_sensor.linear() * sensor.angular_velocity_radps;
    motion.linear_velocity_mps =
        T_base_sensor.linear() * sensor.linear_velocity_mps - motion.angular_velocity_radps.cross(lever);
    // p_base = p_sensor - d with d = R_odom_base * lever: a small rotation r moves it by d x r.
    Matrix6d J = Matrix6d::Identity();
    J.topRightCorner<3, 3>() = skew(motion.T_odom_base.linear() * lever);
    motion.covariance = J * sensor.covariance * J.transpose();
    return motion;
}

void fill_pose(const BaseMotion& motion, pose_t& pose) {
    const Eigen::Quaterniond q(motion.T_odom_base.linear());
    Eigen::Vector3d::Map(pose.position) = motion.T_odom_base.translation();
    Eigen::Vector4d::Map(pose.orientation) = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
    Eigen::Vector3d::Map(pose.linear_velocity) = motion.linear_velocity_mps;
    Eigen::Vector3d::Map(pose.angular_velocity) = motion.angular_velocity_radps;
    Matrix6d::Map(pose.covariance) = motion.covariance;
}

PosePublisher::PosePublisher(MessageBus& bus, const Eigen::Isometry3d& T_base_sensor, const LcmConfig& config)
    : sender_(bus),
      T_base_sensor_(T_base_sensor),
      channel_(config.channel_prefix + "POSE"),
      bot_core_channel_(config.bot_core_channel) {}

void PosePublisher::publish(const Frame& frame, std::int64_t utime) {
    const BaseMotion motion = base_motion(frame.odometry.motion(), T_base_sensor_);
    publish_pose(frame, motion, utime);
    if (frame.odometry.valid && !bot_core_channel_.empty()) publish_bot_core_pose(motion, utime);
}

void PosePublisher::publish_pose(const Frame& frame, const BaseMotion& motion, std::int64_t utime) {
    fill_pose(motion, pose_);
    pose_.utime = utime;
    pose_.sequence = static_cast<std::int64_t>(frame.header.sequence);
    pose_.flags = flags_of(frame.odometry);
    sender_.send(channel_, pose_);
}

void PosePublisher::publish_bot_core_pose(const BaseMotion& motion, std::int64_t utime) {
    const Eigen::Quaterniond q(motion.T_odom_base.linear());
    bot_core_pose_.utime = utime;
    Eigen::Vector3d::Map(bot_core_pose_.pos) = motion.T_odom_base.translation();
    Eigen::Vector3d::Map(bot_core_pose_.vel) = motion.T_odom_base.linear() * motion.linear_velocity_mps;
    Eigen::Vector4d::Map(bot_core_pose_.orientation) = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
    Eigen::Vector3d::Map(bot_core_pose_.rotation_rate) = motion.angular_velocity_radps;
    sender_.send(bot_core_channel_, bot_core_pose_);
}

}  // namespace dlod::daemon
