// The packet path must not allocate: every allocation of the program is counted.
#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "driver/geometry.hpp"
#include "driver/imu.hpp"
#include "tests/driver/synthetic_sensor.hpp"
#include "tests/support/allocation_counter.hpp"

namespace dlod::driver {
namespace {

TEST(FrameBuilderAllocation, NoneOnThePacketPath) {
    const test::SyntheticSensor sensor;
    std::vector<std::unique_ptr<Frame>> pool;
    std::vector<Frame*> free;
    for (int i = 0; i < 3; ++i) {
        pool.push_back(std::make_unique<Frame>(sensor.info().model));
        free.push_back(pool.back().get());
    }
    // Losses, another sensor's packets, a restart and IMU samples among the packets of eight turns.
    std::vector<std::vector<std::byte>> packets;
    test::SyntheticSensor restarted;
    restarted.init_id = 77;
    test::SyntheticSensor stranger;
    stranger.serial_number = 5;
    for (std::uint32_t id = 1; id < 9; ++id) {
        for (int i = 0; i < sensor.packets_per_frame(); ++i) {
            if (i % 11 == 3) packets.push_back(stranger.packet(id, i));
            if (id == 3 && i % 5 == 0) continue;
            packets.push_back((id < 5 ? sensor : restarted).packet(id, i));
            if (i % 3 != 0) continue;
            ImuSample sample;
            sample.stamp_ns = sensor.time_ns(id, 16 * i);
            packets.emplace_back(kLegacyImuPacketBytes);
            encode_imu_packet(packets.back(), sample, sample.stamp_ns);
        }
    }
    const Geometry geometry(sensor.info().model);
    int frames = 0;
    FrameBuilder builder(
        sensor.info(), {},
        [&]() -> Frame* {
            Frame* frame = free.back();
            free.pop_back();
            return frame;
        },
        [&](Frame* frame) {
            geometry.process(*frame);
            free.push_back(frame);
            ++frames;
        });
    const std::size_t before = dlod::test::allocation_count();
    for (const auto& packet : packets)
        builder.push({.data = packet, .receive_ns = 0, .sender_address = {}, .sender_port = 0, .destination_port = 0});
    builder.flush();
    const std::size_t after = dlod::test::allocation_count();
    EXPECT_EQ(frames, 8);
    EXPECT_EQ(builder.counters().restarts.value(), 1U);
    EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace dlod::driver
