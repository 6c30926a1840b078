// IMU samples on their way through the frame builder.
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "driver/frame_builder.hpp"
#include "driver/imu.hpp"
#include "tests/driver/synthetic_sensor.hpp"

namespace dlod::driver {
namespace {

using test::BuilderBench;
using test::EmittedFrame;
using test::SyntheticSensor;

std::vector<std::byte> imu_packet(std::int64_t stamp_ns, float x = 0.0F) {
    std::vector<std::byte> bytes(kLegacyImuPacketBytes);
    encode_imu_packet(bytes, {.stamp_ns = stamp_ns, .acceleration_mps2 = {x, 0.0F, 9.81F}}, stamp_ns);
    return bytes;
}

TEST(FrameBuilderImu, SamplesComeWithTheFrameTheyPrecede) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    // Eight samples a turn; in its first half they come ahead of the columns of their time, then after them.
    for (std::uint32_t id = 1; id < 4; ++id) {
        for (int i = 0; i < 32; ++i) {
            bench.push(sensor.packet(id, i));
            if (i % 4 == 1) bench.push(imu_packet(sensor.time_ns(id, i < 16 ? i * 16 + 90 : i * 16 - 10)));
        }
    }
    bench.push(imu_packet(sensor.time_ns(3, 511) + 1));
    bench.push_frame(4);
    ASSERT_EQ(bench.emitted.size(), 4U);
    for (int k = 0; k < 3; ++k) {
        const EmittedFrame& frame = bench.emitted[static_cast<std::size_t>(k)];
        EXPECT_EQ(frame.imu.size(), 8U);
        for (std::size_t j = 0; j < frame.imu.size(); ++j) {
            EXPECT_LE(frame.imu[j].stamp_ns, frame.header.stamp_ns);
            const std::int64_t previous_ns = j == 0 ? 0 : frame.imu[j - 1].stamp_ns;
            EXPECT_GT(frame.imu[j].stamp_ns, previous_ns);
        }
    }
    ASSERT_EQ(bench.emitted[3].imu.size(), 1U);
    EXPECT_EQ(bench.emitted[3].imu[0].stamp_ns, sensor.time_ns(3, 511) + 1);
    EXPECT_EQ(bench.faults(), 0U);
}

TEST(FrameBuilderImu, EachReadingIsSeenAsItComes) {
    const SyntheticSensor sensor;
    std::vector<std::int64_t> seen;
    FrameBuilder builder(
        sensor.info(), {}, [] { return nullptr; }, [](Frame*) {},
        [&](const ImuSample& sample) { seen.push_back(sample.stamp_ns); });
    const auto push = [&](const std::vector<std::byte>& bytes, std::byte sender) {
        builder.push(
            {.data = bytes, .receive_ns = 0, .sender_address = {sender}, .sender_port = 0, .destination_port = 0});
    };
    push(sensor.packet(1, 0), std::byte{1});
    push(imu_packet(10), std::byte{1});
    EXPECT_EQ(seen, std::vector<std::int64_t>{10}) << "before its frame";
    push(imu_packet(20), std::byte{2});
    push(imu_packet(30, std::numeric_limits<float>::quiet_NaN()), std::byte{1});
    push(imu_packet(40), std::byte{1});
    EXPECT_EQ(seen, (std::vector<std::int64_t>{10, 40})) << "neither a stranger's nor what is no reading";
}

TEST(FrameBuilderImu, FaultsAreCounted) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1, 0, 8);
    bench.push(imu_packet(sensor.time_ns(1, 100)));
    bench.push(imu_packet(sensor.time_ns(1, 100)));                    // twice
    bench.push(imu_packet(sensor.time_ns(1, 0) + 3'600'000'000'000));  // an hour ahead
    bench.push(imu_packet(0));
    bench.push(imu_packet(sensor.time_ns(1, 101), std::numeric_limits<float>::quiet_NaN()));
    bench.push(imu_packet(sensor.time_ns(1, 102), 1e9F));
    bench.sender[0] = std::byte{9};
    bench.push(imu_packet(sensor.time_ns(1, 103)));
    bench.port = sensor.info().imu_port;
    bench.push(std::vector<std::byte>(64));
    bench.port = sensor.info().lidar_port;
    bench.sender[0] = std::byte{0};
    bench.push_frame(1, 8);
    ASSERT_EQ(bench.emitted.size(), 1U);
    ASSERT_EQ(bench.emitted[0].imu.size(), 1U);
    EXPECT_EQ(bench.emitted[0].imu[0].stamp_ns, sensor.time_ns(1, 100));
    EXPECT_EQ(bench.counters().imu_packets.value(), 4U);
    EXPECT_EQ(bench.counters().imu_rejected_samples.value(), 3U);
    EXPECT_EQ(bench.counters().imu_invalid_packets.value(), 2U);
    EXPECT_EQ(bench.counters().foreign_packets.value(), 1U);
    EXPECT_EQ(bench.counters().imu_unknown_packets.value(), 1U);
    EXPECT_EQ(bench.faults(), 7U);
}

}  // namespace
}  // namespace dlod::driver
