#include "tests/tools/sim/recorded_drive.hpp"

#include <algorithm>
#include <cmath>

#include "driver/frame_viewer.hpp"

namespace dlod::tools::sim::test {

RecordedDrive record(const DriveSettings& s) {
    RecordedDrive drive;
    drive.sensor =
        driver::parse_metadata(with_mode(with_profile(make_metadata(s.sensor), s.profile), s.mode), s.sensor);
    const auto scene = std::find_if(scenes().begin(), scenes().end(), [&](const auto& i) { return i.name == s.scene; });
    drive.world = scene->build(s.world);
    const double duration = s.world.duration_s;
    const Lidar lidar(drive.sensor, drive.world, duration,
                      {.seed = s.world.seed, .noise = s.noise, .rough = s.rough, .off_grid_rad = s.off_grid_rad});
    const ImuSimulator imu(drive.world.robot, drive.sensor.model, s.world.seed, s.noise);
    PacketStream stream(drive.sensor, imu, duration, s.world.seed, s.faults);
    const int turns = static_cast<int>(std::lround(duration / drive.sensor.model.frame_period_s));
    run_drive(drive.world, lidar, stream, turns, s.threads,
              [&](const Scan& scan, const std::vector<PacketRecord>& packets, const std::vector<Datagram>& due) {
                  drive.scans.push_back(scan);
                  drive.packets.push_back(packets);
                  drive.datagrams.insert(drive.datagrams.end(), due.begin(), due.end());
              });
    return drive;
}

driver::FrameBuilderCounters decode(const RecordedDrive& drive, const std::function<void(Frame&)>& see) {
    driver::FrameViewer frames(drive.sensor, see);
    for (const Datagram& d : drive.datagrams) {
        const std::uint16_t port = d.imu ? drive.sensor.imu_port : drive.sensor.lidar_port;
        frames.push({.data = d.bytes, .receive_ns = d.send_ns, .destination_port = port});
    }
    frames.flush();
    return frames.counters();
}

}  // namespace dlod::tools::sim::test
