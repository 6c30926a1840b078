// Packets that do not follow from what came before: of strangers, of a sensor that has restarted, damaged ones.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "driver/frame_builder.hpp"
#include "tests/driver/clean_frames.hpp"
#include "tests/driver/synthetic_sensor.hpp"

namespace dlod::driver {
namespace {

using test::BuilderBench;
using test::EmittedFrame;
using test::SyntheticSensor;

TEST(FrameBuilder, ForeignSerialIsCountedAndTouchesNothing) {
    const SyntheticSensor sensor;
    SyntheticSensor other;
    other.serial_number = 999;
    BuilderBench bench(sensor);
    for (std::uint32_t id = 1; id < 4; ++id) {
        for (int i = 0; i < 32; ++i) {
            bench.push(other.packet(id + 500, 31 - i));
            bench.push(sensor.packet(id, i));
        }
    }
    ASSERT_EQ(bench.emitted.size(), 3U);
    for (const EmittedFrame& frame : bench.emitted) EXPECT_EQ(bench.wrong_pixels(frame), 0);
    EXPECT_EQ(bench.counters().foreign_packets.value(), 96U);
    EXPECT_EQ(bench.faults(), 96U);
    EXPECT_EQ(bench.builder.foreign_serial(), 999U);
}

TEST(FrameBuilder, WithoutASerialTheSenderTellsSensorsApart) {
    const SyntheticSensor sensor({.profile = "LEGACY"});
    BuilderBench bench(sensor);
    for (std::uint32_t id = 1; id < 4; ++id) {
        for (int i = 0; i < 32; ++i) {
            bench.sender[15] = std::byte{1};
            bench.push(sensor.packet(id, i));
            bench.sender[15] = std::byte{2};
            bench.push(sensor.packet(id + 300, i));
        }
    }
    ASSERT_EQ(bench.emitted.size(), 3U);
    EXPECT_EQ(bench.counters().foreign_packets.value(), 96U);
    // The first one falls silent: after a while the other is believed.
    for (std::uint32_t id = 400; id < 405; ++id) bench.push_frame(id);
    EXPECT_EQ(bench.emitted.back().header.frame_id, 404U);
    EXPECT_EQ(bench.emitted.back().header.valid_columns, 512);
}

TEST(FrameBuilder, RestartInMidFrameClosesAndGoesOn) {
    SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(500);
    bench.push_frame(501, 0, 20);
    sensor.init_id = 0x654321;
    sensor.epoch_ns = 5'000'000'000;
    bench.push_frame(0, 3);
    ASSERT_EQ(bench.emitted.size(), 2U);
    EXPECT_EQ(bench.emitted[1].header.frame_id, 501U);
    EXPECT_EQ(bench.emitted[1].header.valid_columns, 320);
    // Stragglers of before are no second restart.
    sensor.init_id = 0x123456;
    bench.push_frame(501, 20, 24);
    EXPECT_EQ(bench.counters().restarts.value(), 1U);
    EXPECT_EQ(bench.counters().late_packets.value(), 4U);
    sensor.init_id = 0x654321;
    bench.push_frame(1);
    ASSERT_EQ(bench.emitted.size(), 4U);
    EXPECT_EQ(bench.emitted[2].header.valid_columns, 512 - 48) << "both packets around the confirmation count";
    EXPECT_EQ(bench.counters().restarts.value(), 1U);
    EXPECT_EQ(bench.counters().implausible_packets.value(), 0U);
    EXPECT_EQ(bench.counters().clock_jumps.value(), 0U) << "a restart explains another clock";
}

TEST(FrameBuilder, LegacySensorThatRestartsIsFollowed) {
    const SyntheticSensor sensor({.profile = "LEGACY"});
    BuilderBench bench(sensor);
    bench.push_frame(5000);
    bench.push_frame(5001);
    bench.push_frame(0);
    bench.push_frame(1);
    EXPECT_EQ(bench.emitted.size(), 4U);
    EXPECT_EQ(bench.counters().frame_id_jumps.value(), 1U);
}

TEST(FrameBuilder, AShortCapturePlayedAgainIsFollowed) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    for (int turn = 0; turn < 4; ++turn) {
        for (std::uint32_t id = 1; id < 7; ++id) bench.push_frame(id);
    }
    // After the first turn, stragglers are believed after two frames' worth of packets at the latest.
    EXPECT_GE(bench.emitted.size(), 6U + 3U * 4U);
    EXPECT_GE(bench.counters().frame_id_jumps.value(), 3U);
}

TEST(FrameBuilder, GarbageHeadersCloseNoGoodFrame) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    std::mt19937 random(5);
    bench.push_frame(100);
    bench.push_frame(101, 0, 16);
    std::uint64_t garbage = 0;
    for (int i = 0; i < 200; ++i) {
        auto packet = sensor.packet(101, i % 32);
        const auto frame_id = static_cast<std::uint32_t>((101 + 2 + random() % 60000) % 65536);
        const auto init_id = static_cast<std::uint32_t>(i % 3 == 0 ? random() % 0xFFFFFF : sensor.init_id);
        sensor.layout().write_packet_header(
            packet, {.frame_id = frame_id, .init_id = init_id, .serial_number = sensor.serial_number});
        bench.push(packet);
        ++garbage;
    }
    EXPECT_EQ(bench.emitted.size(), 1U);
    bench.push_frame(101, 16);
    ASSERT_EQ(bench.emitted.size(), 2U);
    EXPECT_EQ(bench.emitted[1].header.valid_columns, 512);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[1]), 0);
    EXPECT_EQ(bench.counters().implausible_packets.value(), garbage);
    expect_clean_frames(bench, 102);
}

TEST(FrameBuilder, FrameIdsAsFarApartAsCanBe) {
    const SyntheticSensor sensor({.profile = "FUSA_RNG15_RFL8_NIR8_DUAL"});
    BuilderBench bench(sensor);
    constexpr std::uint32_t kHalf = std::uint32_t{1} << 31U;
    bench.push_frame(100);
    bench.push_frame(101, 0, 16);
    for (const std::uint32_t far : {7'000'000U, 7'000'000U + kHalf, 7'000'000U}) bench.push(sensor.packet(far, 3));
    EXPECT_EQ(bench.emitted.size(), 1U) << "none of them confirms another";
    EXPECT_EQ(bench.counters().implausible_packets.value(), 2U);
    bench.push_frame(101, 16);
    bench.push_frame(102, 0, 4);
    bench.push(sensor.packet(102 + kHalf, 0));
    bench.push(sensor.packet(102 + kHalf, 1));
    EXPECT_EQ(bench.counters().frame_id_jumps.value(), 1U) << "two confirm each other";
    EXPECT_EQ(bench.counters().lost_frames.value(), 0U);
    bench.push_frame(102 + kHalf, 2);
    expect_clean_frames(bench, 103 + kHalf);
}

TEST(FrameBuilder, WrongSizesAndTypesAreCounted) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1);
    for (const std::size_t size :
         {std::size_t{0}, std::size_t{1}, std::size_t{47}, std::size_t{49}, sensor.layout().packet_bytes() - 1,
          sensor.layout().packet_bytes() + 1, std::size_t{65507}}) {
        bench.push(std::vector<std::byte>(size, std::byte{0xFF}));
    }
    EXPECT_EQ(bench.counters().wrong_size_packets.value(), 7U);
    auto packet = sensor.packet(2, 0);
    sensor.layout().write_packet_header(
        packet, {.type = 2, .frame_id = 2, .init_id = sensor.init_id, .serial_number = sensor.serial_number});
    bench.push(packet);
    EXPECT_EQ(bench.counters().wrong_type_packets.value(), 1U);
    expect_clean_frames(bench, 2);
    EXPECT_EQ(bench.faults(), 8U);
}

TEST(FrameBuilder, MisnumberedColumnsAreNotTrusted) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1);
    bench.push_frame(2, 0, 9);
    auto packet = sensor.packet(2, 9);
    for (const auto& [column, id] : {std::pair{0, 65535}, std::pair{4, 3}, std::pair{9, 511}}) {
        ColumnHeader header = sensor.column(packet, column);
        header.measurement_id = static_cast<std::uint16_t>(id);
        sensor.set_column(packet, column, header);
    }
    bench.push(packet);
    auto damaged = sensor.packet(2, 10);
    for (int c = 0; c < 16; ++c) {
        ColumnHeader header = sensor.column(damaged, c);
        header.measurement_id = static_cast<std::uint16_t>(600 + 37 * c);
        sensor.set_column(damaged, c, header);
    }
    bench.push(damaged);
    bench.push_frame(2, 10);
    bench.push_frame(3);
    ASSERT_EQ(bench.emitted.size(), 3U);
    EXPECT_EQ(bench.emitted[1].header.valid_columns, 509);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[1]), 0);
    EXPECT_EQ(bench.counters().misnumbered_columns.value(), 3U);
    EXPECT_EQ(bench.counters().damaged_packets.value(), 1U);
}

TEST(FrameBuilder, AbsurdColumnTimesAreNotTrusted) {
    const SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1);
    const std::vector<std::uint64_t> absurd{0, ~0ULL, 1ULL << 63U, static_cast<std::uint64_t>(sensor.time_ns(90, 0)),
                                            static_cast<std::uint64_t>(sensor.time_ns(2, 128)) - 1'000'000};
    for (int i = 0; i < 32; ++i) {
        auto packet = sensor.packet(2, i);
        for (std::size_t k = 0; k < absurd.size(); ++k) {
            if (i != static_cast<int>(4 + 2 * k)) continue;
            ColumnHeader header = sensor.column(packet, 7);
            header.time_ns = absurd[k];
            sensor.set_column(packet, 7, header);
        }
        bench.push(packet);
    }
    ASSERT_EQ(bench.emitted.size(), 2U);
    EXPECT_EQ(bench.emitted[1].header.valid_columns, 512 - 5);
    EXPECT_EQ(bench.counters().mistimed_columns.value(), 5U);
    EXPECT_EQ(bench.wrong_pixels(bench.emitted[1]), 0);
    for (std::size_t m = 0; m < 512; ++m) {
        const std::int64_t expected =
            bench.emitted[1].columns.valid[m] != 0 ? sensor.time_ns(2, static_cast<int>(m)) : 0;
        EXPECT_EQ(bench.emitted[1].columns.time_ns[m], expected);
    }
    expect_clean_frames(bench, 3);
}

TEST(FrameBuilder, ClockJumpsBetweenFramesAreCounted) {
    SyntheticSensor sensor;
    BuilderBench bench(sensor);
    bench.push_frame(1);
    bench.push_frame(2);
    sensor.epoch_ns -= 37'000'000'000;
    bench.push_frame(3);
    bench.push_frame(4);
    EXPECT_EQ(bench.emitted.size(), 4U);
    EXPECT_EQ(bench.counters().clock_jumps.value(), 1U);
    EXPECT_EQ(bench.counters().mistimed_columns.value(), 0U);
}

}  // namespace
}  // namespace dlod::driver
