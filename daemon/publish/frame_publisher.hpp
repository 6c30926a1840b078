// A frame's results as LCM messages: pose, dynamic mask, tracks, and where configured obstacles and bot_core's pose.
#pragma once

#include <Eigen/Geometry>
#include <bot_core/pose_t.hpp>
#include <cstdint>
#include <dlod/dynamic_mask_t.hpp>
#include <dlod/obstacles_t.hpp>
#include <dlod/pose_t.hpp>
#include <dlod/tracks_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/types/frame.hpp"
#include "daemon/publish/message_config.hpp"
#include "daemon/publish/message_sender.hpp"
#include "daemon/publish/obstacles.hpp"

namespace dlod::daemon {

/// T_odom_base and the base's motion of an odometry result; odom is the odometry's world frame.
struct BaseMotion {
    Eigen::Isometry3d T_odom_base = Eigen::Isometry3d::Identity();
    Eigen::Vector3d linear_velocity_mps = Eigen::Vector3d::Zero();     ///< base frame
    Eigen::Vector3d angular_velocity_radps = Eigen::Vector3d::Zero();  ///< base frame
    Matrix6d covariance = Matrix6d::Zero();                            ///< of position, then rotation, in odom
};
BaseMotion base_motion(const OdometryResult& odometry, const Eigen::Isometry3d& T_base_sensor);

/// Encodes into buffers made once and publishes; every message fits in one datagram, whatever the scene. For one
/// thread.
class FramePublisher {
  public:
    /// @param T_base_sensor where the sensor sits on the robot
    FramePublisher(MessageBus& bus, const SensorModel& sensor, const Eigen::Isometry3d& T_base_sensor,
                   const LcmConfig& config);

    /// @param utime of all messages [us]
    void publish(const Frame& frame, std::int64_t utime);

    /// Messages that could not be sent; from any thread.
    std::uint64_t failed() const { return sender_.failed(); }

  private:
    void publish_pose(const Frame& frame, const BaseMotion& motion, std::int64_t utime);
    void publish_bot_core_pose(const BaseMotion& motion, std::int64_t utime);
    void publish_mask(const Frame& frame, std::int64_t utime);
    void publish_tracks(const Frame& frame, std::int64_t utime);
    void publish_obstacles(const Frame& frame, const BaseMotion& motion, std::int64_t utime);

    MessageSender sender_;
    Eigen::Isometry3d T_base_sensor_;
    std::string pose_channel_;
    std::string mask_channel_;
    std::string tracks_channel_;
    std::string obstacles_channel_;
    std::string bot_core_channel_;
    int rows_per_part_;
    std::size_t max_tracks_;
    pose_t pose_{};
    dynamic_mask_t mask_{};
    tracks_t tracks_{};
    bot_core::pose_t bot_core_pose_{};
    obstacles_t obstacles_message_{};
    std::vector<std::pair<double, const Track*>> by_distance_;
    std::optional<Obstacles> obstacles_;  ///< where configured
    std::uint64_t obstacles_every_;
    std::optional<std::uint64_t> obstacles_sequence_;  ///< of the last message
};

}  // namespace dlod::daemon
