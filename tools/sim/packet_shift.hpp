// Lets recorded packets go on in time: for drives that are sent more than once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "driver/packet_format.hpp"

namespace dlod::tools::sim {

struct PacketShift {
    std::int64_t time_ns = 0;           ///< added to all stamps
    std::uint32_t frames = 0;           ///< added to frame ids, modulo the field's width
    std::uint32_t initializations = 0;  ///< added to the init id
};

/// Rewrites a lidar packet in place; what is none (of another size or type) stays as it is.
void shift_lidar_packet(std::span<std::byte> packet, const driver::PacketLayout& layout, const PacketShift& shift);
/// Likewise an IMU packet.
void shift_imu_packet(std::span<std::byte> packet, const PacketShift& shift);

}  // namespace dlod::tools::sim
