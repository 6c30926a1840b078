// Which ports of a capture carry the sensor's packets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace dlod::driver {

/// What the metadata says of the packets.
struct ExpectedPackets {
    std::uint16_t lidar_port = 0;
    std::uint16_t imu_port = 0;
    std::size_t lidar_bytes = 0;  ///< UDP payload
    std::size_t imu_bytes = 48;
};

struct PortSelection {
    std::uint16_t lidar_port = 0;
    std::uint16_t imu_port = 0;
    bool lidar_found = false;  ///< the capture has lidar packets of the expected size on that port
    bool imu_found = false;
    std::vector<std::string> warnings;  ///< where the capture differs from the metadata; names the file
};

/// Looks into the capture for the expected packets. The metadata's port holds if packets of the expected size go
/// there; else the port to which most packets of that size go is taken; else the metadata's port stays. Reads no
/// further than two seconds of capture time beyond the first lidar packet. Throws SourceError if the capture cannot be
/// opened.
PortSelection select_ports(const std::filesystem::path& capture, const ExpectedPackets& expected);

}  // namespace dlod::driver
