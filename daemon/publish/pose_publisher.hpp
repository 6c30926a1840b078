// A frame's pose as LCM messages: dlod's own, and where configured bot_core's. They go out before all else of a frame.
#pragma once

#include <Eigen/Geometry>
#include <bot_core/pose_t.hpp>
#include <cstdint>
#include <dlod/pose_t.hpp>
#include <string>

#include "core/types/frame.hpp"
#include "daemon/publish/message_config.hpp"
#include "daemon/publish/message_sender.hpp"

namespace dlod::daemon {

/// T_odom_base and the base's motion, after the sensor's; odom is the odometry's world frame.
struct BaseMotion {
    Eigen::Isometry3d T_odom_base = Eigen::Isometry3d::Identity();
    Eigen::Vector3d linear_velocity_mps = Eigen::Vector3d::Zero();     ///< base frame
    Eigen::Vector3d angular_velocity_radps = Eigen::Vector3d::Zero();  ///< base frame
    Matrix6d covariance = Matrix6d::Zero();                            ///< of position, then rotation, in odom
};
BaseMotion base_motion(const SensorMotion& sensor, const Eigen::Isometry3d& T_base_sensor);

/// All of the message but time, sequence and flags.
void fill_pose(const BaseMotion& motion, pose_t& pose);

/// For one thread, which may be another one than that of the frame's other messages.
class PosePublisher {
  public:
    /// @param T_base_sensor where the sensor sits on the robot
    PosePublisher(MessageBus& bus, const Eigen::Isometry3d& T_base_sensor, const LcmConfig& config);

    /// @param utime of the messages [us]
    void publish(const Frame& frame, std::int64_t utime);

    /// Messages that could not be sent; from any thread.
    std::uint64_t failed() const { return sender_.failed(); }

  private:
    void publish_pose(const Frame& frame, const BaseMotion& motion, std::int64_t utime);
    void publish_bot_core_pose(const BaseMotion& motion, std::int64_t utime);

    MessageSender sender_;
    Eigen::Isometry3d T_base_sensor_;
    std::string channel_;
    std::string bot_core_channel_;
    pose_t pose_{};
    bot_core::pose_t bot_core_pose_{};
};

}  // namespace dlod::daemon
