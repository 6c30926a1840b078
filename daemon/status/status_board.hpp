// Gathers what the operator must know, and makes the message on DLOD_STATUS and the line for systemd of it.
#pragma once

#include <array>
#include <cstdint>
#include <dlod/status_t.hpp>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "daemon/control/command_handler.hpp"
#include "daemon/pipeline/pipeline_frame.hpp"
#include "daemon/status/latency_window.hpp"

namespace dlod::daemon {

/// Totals since the start, by name.
using CounterList = std::vector<std::pair<std::string, std::uint64_t>>;

class StatusBoard {
  public:
    /// @param sensor in words
    /// @param start_ns CLOCK_MONOTONIC
    StatusBoard(std::string version, std::string sensor, std::int64_t start_ns);

    /// A frame is through. @param now_ns CLOCK_MONOTONIC. From any one thread.
    void add(const PipelineFrame& frame, std::int64_t now_ns);

    /// Call it once a second, on one thread: rates are over the time since the call before.
    /// @param last_packet_ns CLOCK_MONOTONIC, 0 where none came yet
    status_t compose(const CounterList& counters, std::int64_t last_packet_ns, std::int64_t now_ns, std::int64_t utime);

    /// The status composed last, with this answer, which stays in those that follow. From any thread.
    status_t answer(const CommandAnswer& answer, std::int64_t utime);

    /// What is wrong with the sensor by its own account, for the health from now on; empty: nothing. On the thread of
    /// compose().
    void set_sensor_trouble(std::string trouble) { sensor_trouble_ = std::move(trouble); }

    /// The composed status in one line.
    std::string one_line() const;

  private:
    void compose_rates(std::int64_t now_ns);
    void compose_stages();
    void compose_health(std::int64_t last_packet_ns, std::int64_t now_ns);
    /// By how much a counter is above what it was at the call of compose() before; 0 where it began anew.
    std::uint64_t rise(const std::string& name) const;

    std::int64_t start_ns_;
    std::int64_t last_compose_ns_;
    std::map<std::string, std::uint64_t> counters_;
    std::map<std::string, std::uint64_t> previous_counters_;
    std::map<std::string, std::int64_t> rose_ns_;  ///< when a counter of losses was last seen to have risen
    std::uint64_t previous_poses_ = 0;
    std::int64_t packets_since_ns_ = 0;  ///< when they were first seen after silence; 0: there are none
    std::string sensor_trouble_;
    mutable std::mutex status_mutex_;  ///< guards status_
    status_t status_{};

    std::mutex mutex_;  ///< guards the rest, which workers write
    std::array<LatencyWindow, kStepCount> steps_;
    LatencyWindow pose_latency_;
    LatencyWindow latency_;
    std::uint64_t poses_ = 0;
    std::int64_t last_pose_ns_ = 0;
};

}  // namespace dlod::daemon
