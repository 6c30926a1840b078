// A short simulated drive in memory, and what the driver makes of it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/types/frame.hpp"
#include "driver/frame_builder.hpp"
#include "tools/sim/drive.hpp"
#include "tools/sim/sensor_metadata.hpp"

namespace dlod::tools::sim::test {

struct DriveSettings {
    std::string scene = "square";
    SceneOptions world{.seed = 5, .duration_s = 0.5, .movers = true, .robot = {.speed_mps = 2.0, .standing_s = 0.0}};
    std::string sensor = "OS1-32";
    std::string mode = "512x10";
    std::string profile = "RNG19_RFL8_SIG16_NIR16";
    bool noise = true;
    bool rough = false;
    double off_grid_rad = 0.0;
    int threads = 2;
    FaultOptions faults;
};

struct RecordedDrive {
    driver::SensorInfo sensor;
    World world;
    std::vector<Scan> scans;
    std::vector<std::vector<PacketRecord>> packets;  ///< a turn
    std::vector<Datagram> datagrams;
};

RecordedDrive record(const DriveSettings& settings);

/// Runs the datagrams through the frame builder; `see` gets each frame.
driver::FrameBuilderCounters decode(const RecordedDrive& drive, const std::function<void(Frame&)>& see);

}  // namespace dlod::tools::sim::test
