// Captures of every kind and sensors of every shape, from the file to the results.
#include <gtest/gtest.h>
#include <poll.h>

#include <cmath>
#include <string>
#include <vector>

#include "daemon/output/result_writer.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "driver/pcap_source.hpp"
#include "tests/support/file_content.hpp"
#include "tests/support/network_bytes.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

using test::content;

using test::FileKind;

struct Outcome {
    std::uint64_t frames = 0;
    std::uint64_t complete_frames = 0;
    std::uint64_t valid_poses = 0;
    Eigen::Vector3d last_position_m = Eigen::Vector3d::Zero();
    std::string trajectory, labels;
};

Outcome replay(const std::filesystem::path& capture, const driver::SensorInfo& sensor) {
    const test::TemporaryFolder out;
    ResultWriter writer(out.path(), TimingClock::kWall);
    driver::PcapSource source(capture, {.ports = {sensor.lidar_port, sensor.imu_port}, .reassembly = {}});
    Outcome outcome;
    FrameSinks sinks;
    sinks.write = [&](PipelineFrame& frame) {
        ++outcome.frames;
        outcome.complete_frames += frame.header.valid_columns == sensor.model.width ? 1 : 0;
        outcome.valid_poses += frame.odometry.valid ? 1 : 0;
        outcome.last_position_m = frame.odometry.T_world_sensor.translation();
        writer.write(frame);
    };
    Pipeline pipeline(sensor, {}, {}, source, std::move(sinks), {.threads = 2});
    pipeline.start();
    pollfd done{pipeline.done_descriptor(), POLLIN, 0};
    while (!pipeline.done()) {
        if (::poll(&done, 1, 60'000) < 1) {
            ADD_FAILURE() << "the pipeline hangs";
            return outcome;
        }
    }
    pipeline.rethrow_failure();
    pipeline.map().finish();
    writer.finish(pipeline.map().points());
    outcome.trajectory = content(out.path() / "trajectory.tum");
    outcome.labels = content(out.path() / "labels.bin");
    return outcome;
}

TEST(ReplayFormats, EveryShapeOfSensorAndProfile) {
    struct Shape {
        const char* profile;
        int rows, columns, frames;
    };
    for (const Shape& shape :
         {Shape{"LEGACY", 64, 1024, 8}, Shape{"LEGACY", 32, 512, 12}, Shape{"RNG15_RFL8_NIR8", 16, 512, 12},
          Shape{"RNG15_RFL8_NIR8_DUAL", 64, 1024, 6}, Shape{"RNG19_RFL8_SIG16_NIR16", 128, 2048, 4},
          Shape{"RNG19_RFL8_SIG16_NIR16_DUAL", 16, 1024, 8}, Shape{"FUSA_RNG15_RFL8_NIR8_DUAL", 32, 1024, 8},
          Shape{"RNG15_RFL8_NIR8", 32, 4096, 4}}) {
        SCOPED_TRACE(std::string(shape.profile) + " " + std::to_string(shape.rows) + " x " +
                     std::to_string(shape.columns));
        test::SyntheticSensor setup;
        setup.profile = shape.profile;
        setup.rows = shape.rows;
        setup.columns = shape.columns;
        const test::TemporaryFolder folder;
        const auto capture = test::SyntheticCapture(shape.frames, setup).write(folder.path());
        const auto sensor = driver::load_metadata(folder.path() / "drive.json");
        const Outcome outcome = replay(capture, sensor);
        const auto frames = static_cast<std::uint64_t>(shape.frames);
        EXPECT_EQ(outcome.frames, frames);
        EXPECT_EQ(outcome.complete_frames, frames);
        EXPECT_EQ(outcome.valid_poses, frames);
        EXPECT_EQ(outcome.labels.size(), frames * sensor.model.pixels());
        // 1 m/s between the last columns of the first and the last frame. From 16 rows the odometry sees little.
        const double travelled_m = 0.1 * (shape.frames - 1);
        EXPECT_NEAR(outcome.last_position_m.norm(), travelled_m, shape.rows > 16 ? 0.03 : 0.1);
    }
}

TEST(ReplayFormats, EveryKindOfCaptureGivesTheSameBytes) {
    const test::TemporaryFolder folder;
    const test::SyntheticCapture drive(8);
    const auto classic = drive.write(folder.path());
    const auto sensor = driver::load_metadata(folder.path() / "drive.json");
    const Outcome expected = replay(classic, sensor);
    ASSERT_EQ(expected.complete_frames, 8U);
    ASSERT_EQ(expected.valid_poses, 8U);

    constexpr int kEthernet = 1, kRaw = 101, kCooked = 113, kCooked2 = 276;
    struct Kind {
        const char* name;
        FileKind file;
        int link;
        std::vector<unsigned> vlans;
        bool fragments;
    };
    for (const Kind& kind :
         {Kind{"pcapng, Ethernet", FileKind::kPcapng, kEthernet, {}, false},
          Kind{"pcapng, Ethernet, VLAN, fragments", FileKind::kPcapngNanosecond, kEthernet, {7}, true},
          Kind{"pcap, Ethernet, two VLANs", FileKind::kMicrosecond, kEthernet, {7, 100}, false},
          Kind{"pcap, cooked", FileKind::kNanosecond, kCooked, {}, false},
          Kind{"pcapng, cooked v2, fragments", FileKind::kPcapng, kCooked2, {}, true},
          Kind{"pcap, cooked v2, VLAN", FileKind::kNanosecondSwapped, kCooked2, {100}, false},
          Kind{"pcap, raw, fragments", FileKind::kMicrosecondSwapped, kRaw, {}, true}}) {
        SCOPED_TRACE(kind.name);
        std::vector<test::Record> records;
        std::uint32_t id = 0;
        for (const auto& packet : drive.packets()) {
            const auto datagram = test::udp(packet.data, {.source_port = packet.port, .port = packet.port});
            const test::IpFields fields{.id = id++};
            const auto parts = kind.fragments ? test::ip_fragments(datagram, fields)
                                              : std::vector<test::ByteVector>{test::ip(datagram, fields)};
            for (const auto& part : parts) {
                records.push_back({packet.time_ns, test::link_frame(kind.link, part, kind.vlans)});
            }
        }
        const test::ScratchFolder scratch;
        const auto capture =
            scratch.write("drive", test::capture_file(kind.file, static_cast<std::uint32_t>(kind.link), records));
        const Outcome outcome = replay(capture, sensor);
        EXPECT_EQ(outcome.frames, 8U);
        EXPECT_TRUE(outcome.trajectory == expected.trajectory);
        EXPECT_TRUE(outcome.labels == expected.labels);
    }
}

}  // namespace
}  // namespace dlod::daemon
