// Random and damaged packets by the hundred thousand: nothing may crash or reach outside of the frames (the sanitizers
// watch), every datagram must be accounted for, and good frames must come out right as soon as the storm is over.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "tests/driver/synthetic_sensor.hpp"

namespace dlod::driver {
namespace {

using test::BuilderBench;
using test::SyntheticSensor;

int iterations() {
    const char* requested = std::getenv("DLOD_FUZZ_ITERATIONS");
    return requested == nullptr ? 120'000 : std::atoi(requested);
}

std::vector<std::byte> random_bytes(std::size_t size, std::mt19937& random) {
    std::vector<std::byte> bytes(size);
    for (std::byte& b : bytes) b = static_cast<std::byte>(random());
    return bytes;
}

/// A packet with some of its header bytes damaged, or its columns shuffled, or nonsense of a size near by.
std::vector<std::byte> damaged(const SyntheticSensor& sensor, std::uint32_t frame_id, std::mt19937& random) {
    auto packet = sensor.packet(frame_id + static_cast<std::uint32_t>(random() % 4), static_cast<int>(random() % 32));
    const auto column_header = [&] {
        return sensor.layout().column_offset(static_cast<int>(random() % 16)) + random() % 16;
    };
    switch (random() % 8) {
        case 0:
            return random_bytes(packet.size(), random);
        case 1:
            return random_bytes(random() % 3 == 0 ? 48 : random() % 200, random);
        case 2:
            packet.resize(packet.size() - random() % packet.size());
            return packet;
        case 3:
            for (auto n = random() % 20; n > 0; --n) packet[random() % 32] = static_cast<std::byte>(random());
            return packet;
        case 4:
            for (auto n = random() % 60; n > 0; --n) packet[column_header()] = static_cast<std::byte>(random());
            return packet;
        case 5:
            for (auto n = random() % 400; n > 0; --n)
                packet[random() % packet.size()] ^= static_cast<std::byte>(1U << random() % 8);
            return packet;
        case 6: {  // a header that passes, columns that do not
            for (int c = 0; c < 16; ++c) {
                sensor.set_column(packet, c,
                                  {.time_ns = random() * 1ULL << 32U,
                                   .measurement_id = static_cast<std::uint16_t>(random() % 600),
                                   .frame_id = static_cast<std::uint16_t>(frame_id),
                                   .encoder_count = 0,
                                   .status = static_cast<std::uint32_t>(random())});
            }
            return packet;
        }
        default: {  // shifted as a whole: measurements run beyond the frame, or before it
            const auto first = static_cast<int>(random() % 66000) - 40;
            for (int c = 0; c < 16; ++c) {
                ColumnHeader header = sensor.column(packet, c);
                header.measurement_id = static_cast<std::uint16_t>(first + c);
                sensor.set_column(packet, c, header);
            }
            return packet;
        }
    }
}

class Fuzz : public ::testing::TestWithParam<std::string> {};

TEST_P(Fuzz, DamagedPacketsDoNoHarm) {
    const SyntheticSensor sensor({.profile = GetParam()});
    BuilderBench bench(sensor);
    std::mt19937 random(11);
    std::uint32_t frame_id = 65000;
    const int rounds = iterations() / 3 / 400;
    for (int round = 0; round < rounds; ++round) {
        for (int i = 0; i < 400; ++i) {
            bench.port = static_cast<std::uint16_t>(random() % 4 == 0 ? 7503 : 7502);
            bench.push(damaged(sensor, frame_id, random));
        }
        bench.port = 7502;
        for (const test::EmittedFrame& frame : bench.emitted) {
            ASSERT_GE(frame.header.stamp_ns, frame.header.valid_columns > 0 ? 1 : 0);
            ASSERT_LE(frame.header.first_stamp_ns, (1LL << 62));
        }
        bench.emitted.clear();
        // The storm may have left the builder anywhere: it finds its way within two frames.
        frame_id += 1000;
        for (std::uint32_t k = 0; k < 4; ++k) bench.push_frame(frame_id + k);
        ASSERT_GE(bench.emitted.size(), 2U);
        for (std::size_t k = bench.emitted.size() - 2; k < bench.emitted.size(); ++k) {
            ASSERT_EQ(bench.emitted[k].header.valid_columns, 512);
            ASSERT_EQ(bench.wrong_pixels(bench.emitted[k]), 0);
        }
        bench.emitted.clear();
    }
    bench.builder.flush();
    EXPECT_EQ(bench.free_frames.size(), 3U);
    const FrameBuilderCounters& c = bench.counters();
    std::uint64_t accounted = 0;
    for (const Counter* counter :
         {&c.lidar_packets, &c.imu_packets, &c.duplicate_packets, &c.late_packets, &c.wrong_size_packets,
          &c.wrong_type_packets, &c.foreign_packets, &c.implausible_packets, &c.damaged_packets, &c.dropped_packets,
          &c.imu_unknown_packets, &c.imu_invalid_packets}) {
        accounted += counter->value();
    }
    EXPECT_EQ(accounted, c.packets.value());
}

INSTANTIATE_TEST_SUITE_P(FrameBuilder, Fuzz,
                         ::testing::Values("LEGACY", "RNG15_RFL8_NIR8", "FUSA_RNG15_RFL8_NIR8_DUAL"),
                         [](const auto& profile) { return profile.param; });

}  // namespace
}  // namespace dlod::driver
