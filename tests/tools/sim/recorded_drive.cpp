#include "tests/tools/sim/recorded_drive.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace dlod::tools::sim::test {

RecordedDrive record(const DriveSettings& s) {
    RecordedDrive drive;
    drive.sensor =
        driver::parse_metadata(with_mode(with_profile(make_metadata(s.sensor), s.profile), s.mode), s.sensor);
    const auto scene = std::find_if(scenes().begin(), scenes().end(), [&](const auto& i) { return i.name == s.scene; });
    drive.world = scene->build(s.world);
    const double duration = s.world.duration_s;
    const Lidar lidar(drive.sensor, drive.world, duration, {.seed = s.world.seed, .noise = s.noise});
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
    std::vector<std::unique_ptr<Frame>> frames;
    std::vector<Frame*> free;
    for (int i = 0; i < 4; ++i) {
        frames.push_back(std::make_unique<Frame>(drive.sensor.model));
        free.push_back(frames.back().get());
    }
    driver::FrameBuilder builder(
        drive.sensor, {},
        [&]() -> Frame* {
            if (free.empty()) return nullptr;
            Frame* frame = free.back();
            free.pop_back();
            return frame;
        },
        [&](Frame* frame) {
            see(*frame);
            free.push_back(frame);
        });
    for (const Datagram& d : drive.datagrams) {
        const std::uint16_t port = d.imu ? drive.sensor.imu_port : drive.sensor.lidar_port;
        builder.push({.data = d.bytes, .receive_ns = d.send_ns, .destination_port = port});
    }
    builder.flush();
    return builder.counters();
}

}  // namespace dlod::tools::sim::test
