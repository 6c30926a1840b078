// A drive's datagrams over UDP, at the times at which a sensor would send them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "driver/metadata.hpp"
#include "tools/sim/datagram.hpp"

namespace dlod::tools::sim {

struct LiveOptions {
    std::string host;
    std::uint16_t lidar_port = 7502;
    std::uint16_t imu_port = 7503;
    int loops = 1;      ///< the drive again and again, clock and frame ids going on
    double rate = 1.0;  ///< 2: twice as fast
};

struct LiveResult {
    std::uint64_t datagrams = 0;
    std::uint64_t refused = 0;   ///< by the network; they are lost
    double late_worst_ms = 0.0;  ///< largest delay against the schedule
};

/// Sends `drive` of `turns` turns; `progress` is called with the share done, `stop` asked in between. Frame ids, init
/// id and times of later loops are rewritten in place. Throws std::runtime_error if host or socket do not work.
LiveResult send_live(std::vector<Datagram>& drive, int turns, const driver::SensorInfo& sensor,
                     const LiveOptions& options, const std::function<void(double)>& progress,
                     const std::function<bool()>& stop);

}  // namespace dlod::tools::sim
