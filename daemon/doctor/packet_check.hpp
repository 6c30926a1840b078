// Do the sensor's packets arrive whole?
#pragma once

#include <chrono>
#include <cstdint>

#include "daemon/config/config.hpp"
#include "daemon/doctor/checks.hpp"
#include "driver/metadata.hpp"

namespace dlod::daemon {

/// What arrived on the sensor's ports.
struct PacketCount {
    std::uint64_t packets = 0;        ///< of any kind
    std::uint64_t lidar_packets = 0;  ///< that fit the metadata
    std::uint64_t lost_packets = 0;   ///< missing between those
    std::uint64_t kernel_drops = 0;   ///< lost in this host's receive buffer
    std::uint64_t foreign = 0;        ///< of another sensor
    std::uint64_t unfit = 0;          ///< of a size or type that the metadata do not tell of
};

/// Listens on the ports of the configuration and the metadata for so long.
/// @throws driver::SourceError where they cannot be opened
PacketCount count_packets(const SensorConfig& config, const driver::SensorInfo& sensor, std::chrono::milliseconds time);

/// What a count means.
Check judge_packets(const PacketCount& count, std::chrono::milliseconds time);

/// Both, with the metadata from where a live run has them. Ports that are in use are good: dlod itself listens.
Check check_packets(const SensorConfig& config, std::chrono::milliseconds time);

}  // namespace dlod::daemon
