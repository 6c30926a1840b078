// The points around the robot that a planner must not drive into, thinned to fit into one message.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dlod/obstacles_t.hpp>
#include <vector>

#include "core/types/frame.hpp"
#include "daemon/publish/message_config.hpp"

namespace dlod::daemon {

/// One point a voxel of the odom frame, the nearest first; of a voxel's points the first one of the image, but a moving
/// one before one that is undecided before any other. Depends on nothing but the frame.
class Obstacles {
  public:
    /// @param most points in a message
    Obstacles(const SensorModel& sensor, const ObstaclesConfig& config, std::size_t most);

    /// Fills all of `message` but utime. @param frame with a valid pose
    void extract(const Frame& frame, const Eigen::Vector3d& base_in_odom_m, obstacles_t& message);

  private:
    struct Point {
        float x, y, z;  ///< from the base, odom's axes, metres
        float distance2_m2;
        std::uint32_t track;
        std::int8_t flags;
    };
    struct Slot {
        std::uint64_t key = 0;
        std::uint32_t frame = 0;  ///< the slot is taken where this is the frame at hand
        std::uint32_t point = 0;
    };
    Slot& slot_of(std::uint64_t key);
    void collect(const Frame& frame, const Eigen::Vector3d& base_in_odom_m);

    ObstaclesConfig config_;
    std::size_t most_;
    std::vector<Slot> slots_;
    std::uint32_t frame_ = 0;
    std::vector<Point> points_;
};

}  // namespace dlod::daemon
