// A packet on its way from the simulated sensor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace dlod::tools::sim {

/// Sensor time of the drive's start.
inline constexpr std::int64_t kEpoch_ns = 1'700'000'000'000'000'000;

struct Datagram {
    std::vector<std::byte> bytes;
    std::int64_t send_ns = 0;
    bool imu = false;
};

}  // namespace dlod::tools::sim
