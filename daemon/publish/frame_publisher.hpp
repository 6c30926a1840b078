// What is moving in a frame as LCM messages: dynamic mask, tracks, and where configured obstacles.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <dlod/dynamic_mask_t.hpp>
#include <dlod/obstacles_t.hpp>
#include <dlod/tracks_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/types/frame.hpp"
#include "daemon/publish/message_config.hpp"
#include "daemon/publish/message_sender.hpp"
#include "daemon/publish/obstacles.hpp"

namespace dlod::daemon {

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
    void publish_mask(const Frame& frame, std::int64_t utime);
    void publish_tracks(const Frame& frame, std::int64_t utime);
    void publish_obstacles(const Frame& frame, std::int64_t utime);

    MessageSender sender_;
    Eigen::Isometry3d T_sensor_base_;
    std::string mask_channel_;
    std::string tracks_channel_;
    std::string obstacles_channel_;
    int rows_per_part_;
    std::size_t max_tracks_;
    dynamic_mask_t mask_{};
    tracks_t tracks_{};
    obstacles_t obstacles_message_{};
    std::vector<std::pair<double, const Track*>> by_distance_;
    std::optional<Obstacles> obstacles_;  ///< where configured
    std::uint64_t obstacles_every_;
    std::optional<std::uint64_t> obstacles_sequence_;  ///< of the last message
};

}  // namespace dlod::daemon
