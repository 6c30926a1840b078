#include "driver/frame_builder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/driver/clean_frames.hpp"
#include "tests/driver/synthetic_sensor.hpp"

namespace dlod::driver {
namespace {

using test::BuilderBench;
using test::EmittedFrame;
using test::SyntheticSensor;

class EveryProfile : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryProfile, DecodesWhatWasEncoded) {
    for (const int rows : {16, 32, 64, 128}) {
        for (const int columns : {512, 1024, 2048, 4096}) {
            for (const int columns_per_packet : {16, 8}) {
                if (columns_per_packet == 8 && columns != 512) continue;
                const SyntheticSensor sensor({.profile = GetParam(),
                                              .rows = rows,
                                              .columns = columns,
                                              .columns_per_packet = columns_per_packet});
                BuilderBench bench(sensor);
                bench.push_frame(65535);
                ASSERT_EQ(bench.emitted.size(), 1U) << rows << " x " << columns;
                const EmittedFrame& frame = bench.emitted[0];
                EXPECT_EQ(bench.wrong_pixels(frame), 0) << rows << " x " << columns;
                EXPECT_EQ(frame.header.valid_columns, columns);
                EXPECT_EQ(frame.header.frame_id, 65535U);
                EXPECT_EQ(frame.header.first_stamp_ns, sensor.time_ns(65535, 0));
                EXPECT_EQ(frame.header.stamp_ns, sensor.time_ns(65535, columns - 1));
                EXPECT_TRUE(frame.header.usable);
                EXPECT_EQ(bench.faults(), 0U);
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(FrameBuilder, EveryProfile,
                         ::testing::Values("LEGACY", "RNG19_RFL8_SIG16_NIR16", "RNG19_RFL8_SIG16_NIR16_DUAL",
                                           "RNG15_RFL8_NIR8", "RNG15_RFL8_NIR8_DUAL", "FUSA_RNG15_RFL8_NIR8_DUAL"),
                         [](const auto& profile) { return profile.param; });

TEST(FrameBuilder, EmitsOnTheCompletingPacketWithItsReceiveTime) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(7, 0, sensor.packets_per_frame() - 1);
    EXPECT_TRUE(bench.emitted.empty());
    bench.push(sensor.packet(7, sensor.packets_per_frame() - 1));
    ASSERT_EQ(bench.emitted.size(), 1U);
    EXPECT_EQ(bench.emitted[0].header.receive_ns, bench.receive_ns);
    EXPECT_EQ(bench.emitted[0].header.sequence, 0U);
    for (int m = 0; m < 512; ++m) {
        EXPECT_EQ(bench.emitted[0].columns.time_ns[static_cast<std::size_t>(m)], sensor.time_ns(7, m));
        EXPECT_EQ(bench.emitted[0].columns.status[static_cast<std::size_t>(m)], 1U);
    }
}

TEST(FrameBuilder, ColumnWindowDecidesWhenAFrameIsComplete) {
    // Packets 5 .. 12 touch the window; columns outside of it are marked invalid by the sensor.
    const SyntheticSensor sensor({.window_first = 90, .window_last = 200});
    BuilderBench bench(sensor);
    for (int i = 5; i <= 12; ++i) {
        auto packet = sensor.packet(3, i);
        for (int c = 0; c < 16; ++c) {
            ColumnHeader header = sensor.column(packet, c);
            header.status = header.measurement_id >= 90 && header.measurement_id <= 200 ? 1 : 0;
            sensor.set_column(packet, c, header);
        }
        EXPECT_TRUE(bench.emitted.empty());
        bench.push(packet);
    }
    ASSERT_EQ(bench.emitted.size(), 1U);
    EXPECT_EQ(bench.emitted[0].header.valid_columns, 111);
    EXPECT_EQ(bench.emitted[0].header.stamp_ns, sensor.time_ns(3, 200));
    EXPECT_TRUE(bench.emitted[0].header.usable);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[0]), 0);
    EXPECT_EQ(bench.faults(), 0U);
}

TEST(FrameBuilder, ColumnWindowMayWrap) {
    const SyntheticSensor sensor({.window_first = 370, .window_last = 85});
    BuilderBench bench(sensor);
    for (int i = 0; i <= 5; ++i) bench.push(sensor.packet(3, i));
    for (int i = 23; i <= 30; ++i) bench.push(sensor.packet(3, i));
    EXPECT_TRUE(bench.emitted.empty());
    bench.push(sensor.packet(3, 31));
    ASSERT_EQ(bench.emitted.size(), 1U);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[0]), 0);
    EXPECT_EQ(bench.counters().lost_packets.value(), 0U);
}

TEST(FrameBuilder, FrameIdWraps) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    for (std::uint32_t id = 65533; id < 65540; ++id) bench.push_frame(id);
    ASSERT_EQ(bench.emitted.size(), 7U);
    EXPECT_EQ(bench.emitted[2].header.frame_id, 65535U);
    EXPECT_EQ(bench.emitted[3].header.frame_id, 0U);
    EXPECT_EQ(bench.faults(), 0U);
}

TEST(FrameBuilder, LostPacketsLeaveZerosAndAreCounted) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(10);
    for (int i = 0; i < 32; ++i) {
        if (i != 4 && i != 5 && i != 31) bench.push(sensor.packet(11, i));
    }
    EXPECT_EQ(bench.emitted.size(), 1U);
    bench.push_frame(12, 0, FrameBuilder::kPacketsToClose - 1);
    EXPECT_EQ(bench.emitted.size(), 1U) << "closed too early for reordered packets";
    bench.push_frame(12, FrameBuilder::kPacketsToClose - 1);
    ASSERT_EQ(bench.emitted.size(), 3U);
    const EmittedFrame& gappy = bench.emitted[1];
    EXPECT_EQ(gappy.header.valid_columns, 512 - 48);
    EXPECT_EQ(gappy.header.stamp_ns, sensor.time_ns(11, 495));
    EXPECT_TRUE(gappy.header.usable);
    EXPECT_EQ(gappy.columns.time_ns[64], 0);
    EXPECT_EQ(gappy.columns.valid[64], 0);
    EXPECT_EQ(bench.wrong_pixels(gappy), 0);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[2]), 0);
    EXPECT_EQ(bench.counters().lost_packets.value(), 3U);
    EXPECT_EQ(bench.counters().incomplete_frames.value(), 1U);
    EXPECT_EQ(bench.faults(), 4U);
}

TEST(FrameBuilder, MinimumShareOfColumnsDecidesUse) {
    for (const int packets : {7, 8}) {
        const SyntheticSensor sensor;
        BuilderBench bench(sensor);
        bench.push_frame(1);
        bench.push_frame(2, 0, packets);  // 8 of 32 packets are the least share that is enough, 0.25
        bench.push_frame(3);
        ASSERT_EQ(bench.emitted.size(), 3U);
        EXPECT_EQ(bench.emitted[1].header.usable, packets == 8);
        EXPECT_EQ(bench.counters().unusable_frames.value(), packets == 8 ? 0U : 1U);
    }
}

TEST(FrameBuilder, WholeLostFramesAreCounted) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1);
    bench.push_frame(3);
    bench.push_frame(10);
    ASSERT_EQ(bench.emitted.size(), 3U);
    for (const EmittedFrame& frame : bench.emitted) EXPECT_EQ(frame.header.valid_columns, 512);
    EXPECT_EQ(bench.counters().lost_frames.value(), 1U + 6U);
    EXPECT_EQ(bench.counters().implausible_packets.value(), 0U);
}

TEST(FrameBuilder, ReorderedAcrossTheEdgeLosesNothing) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1, 0, 30);
    bench.push(sensor.packet(2, 0));
    bench.push(sensor.packet(1, 31));
    bench.push(sensor.packet(2, 1));
    bench.push(sensor.packet(2, 2));
    bench.push(sensor.packet(1, 30));
    ASSERT_EQ(bench.emitted.size(), 1U);
    bench.push_frame(2, 3);
    ASSERT_EQ(bench.emitted.size(), 2U);
    for (const EmittedFrame& frame : bench.emitted) {
        EXPECT_EQ(frame.header.valid_columns, 512);
        EXPECT_EQ(bench.wrong_pixels(frame), 0);
    }
    EXPECT_EQ(bench.counters().reordered_packets.value(), 2U);
    EXPECT_EQ(bench.faults(), 2U);
}

TEST(FrameBuilder, ReorderedWithinAFrame) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    for (std::uint32_t id = 1; id < 6; ++id) {
        std::vector<int> order(32);
        for (int i = 0; i < 32; ++i) order[static_cast<std::size_t>(i)] = i;
        std::shuffle(order.begin(), order.end(), std::mt19937(id));
        for (const int i : order) bench.push(sensor.packet(id, i));
    }
    ASSERT_EQ(bench.emitted.size(), 5U);
    for (const EmittedFrame& frame : bench.emitted) EXPECT_EQ(bench.wrong_pixels(frame), 0);
    EXPECT_GT(bench.counters().reordered_packets.value(), 50U);
    EXPECT_EQ(bench.faults(), bench.counters().reordered_packets.value());
}

TEST(FrameBuilder, DuplicatesCountOnceEachEvenAfterTheFrameWasClosed) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    for (std::uint32_t id = 1; id < 4; ++id) {
        for (int i = 0; i < 32; ++i) {
            bench.push(sensor.packet(id, i));
            bench.push(sensor.packet(id, i));
        }
    }
    ASSERT_EQ(bench.emitted.size(), 3U);
    for (const EmittedFrame& frame : bench.emitted) EXPECT_EQ(bench.wrong_pixels(frame), 0);
    EXPECT_EQ(bench.counters().duplicate_packets.value(), 96U);
    EXPECT_EQ(bench.faults(), 96U);
}

TEST(FrameBuilder, LatePacketsAreDropped) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1);
    bench.push_frame(2, 0, 31);
    bench.push_frame(3, 0, 10);
    bench.push(sensor.packet(2, 31));
    bench.push_frame(3, 10);
    ASSERT_EQ(bench.emitted.size(), 3U);
    EXPECT_EQ(bench.emitted[1].header.valid_columns, 496);
    EXPECT_EQ(bench.counters().late_packets.value(), 1U);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[2]), 0);
}

TEST(FrameBuilder, InvalidColumnsAreCountedAndZero) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1, 0, 8);
    auto packet = sensor.packet(1, 8);
    for (const int c : {0, 3, 15}) {
        ColumnHeader header = sensor.column(packet, c);
        header.status = 0;
        sensor.set_column(packet, c, header);
    }
    bench.push(packet);
    bench.push_frame(1, 9);
    ASSERT_EQ(bench.emitted.size(), 1U);
    EXPECT_EQ(bench.emitted[0].header.valid_columns, 509);
    EXPECT_EQ(bench.emitted[0].columns.time_ns[131], sensor.time_ns(1, 131)) << "an invalid column has a time";
    EXPECT_EQ(bench.counters().invalid_columns.value(), 3U);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[0]), 0);
}

TEST(FrameBuilder, AFrameWithoutAValidColumnIsNotUsable) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    for (int i = 0; i < 32; ++i) {
        auto packet = sensor.packet(1, i);
        for (int c = 0; c < 16; ++c) {
            ColumnHeader header = sensor.column(packet, c);
            header.status = 0;
            sensor.set_column(packet, c, header);
        }
        bench.push(packet);
    }
    ASSERT_EQ(bench.emitted.size(), 1U);
    EXPECT_EQ(bench.emitted[0].header.valid_columns, 0);
    EXPECT_FALSE(bench.emitted[0].header.usable);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[0]), 0);
}

TEST(FrameBuilder, WithoutFreeFramesWholeFramesAreDropped) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1);
    std::vector<Frame*> taken;
    taken.swap(bench.free_frames);
    bench.push_frame(2);
    bench.push_frame(3, 0, 16);
    taken.swap(bench.free_frames);
    bench.push_frame(3, 16);
    EXPECT_EQ(bench.emitted.size(), 1U);
    EXPECT_EQ(bench.counters().dropped_frames.value(), 2U);
    EXPECT_EQ(bench.counters().dropped_packets.value(), 64U);
    expect_clean_frames(bench, 4);
    EXPECT_EQ(bench.emitted.front().header.sequence, 0U);
    EXPECT_EQ(bench.emitted[1].header.sequence, 3U) << "who sees the numbers sees that two frames are missing";
    EXPECT_EQ(bench.emitted.back().header.sequence, 5U);
}

TEST(FrameBuilder, FlushEmitsWhatIsThere) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1, 12);
    bench.push_frame(2, 0, 30);
    bench.push_frame(3, 0, 2);
    bench.builder.flush();
    ASSERT_EQ(bench.emitted.size(), 3U);
    EXPECT_EQ(bench.emitted[0].header.valid_columns, 320);
    EXPECT_EQ(bench.emitted[1].header.valid_columns, 480);
    EXPECT_EQ(bench.emitted[2].header.valid_columns, 32);
    EXPECT_EQ(bench.counters().lost_packets.value(), 2U) << "neither the capture's start nor its end is a loss";
    EXPECT_EQ(bench.free_frames.size(), 3U);
    bench.builder.flush();
    EXPECT_EQ(bench.emitted.size(), 3U);
}

TEST(FrameBuilder, FlushBelievesACaptureOfOnePacket) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push(sensor.packet(892, 3));
    EXPECT_TRUE(bench.emitted.empty());
    bench.builder.flush();
    ASSERT_EQ(bench.emitted.size(), 1U);
    EXPECT_EQ(bench.emitted[0].header.valid_columns, 16);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[0]), 0);
}

}  // namespace
}  // namespace dlod::driver
