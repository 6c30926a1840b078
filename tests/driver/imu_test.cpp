#include "driver/imu.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "driver/imu_queue.hpp"

namespace dlod::driver {
namespace {

TEST(Imu, DecodesARealPacket) {
    // The first IMU packet of the capture OS-0-128-U1_v2.3.0_1024x10, byte for byte.
    const std::vector<int> hex{0x6e, 0xdd, 0xad, 0x88, 0x54, 0x01, 0x00, 0x00, 0x84, 0x23, 0xb1, 0x88,
                               0x54, 0x01, 0x00, 0x00, 0xb6, 0x89, 0xb4, 0x88, 0x54, 0x01, 0x00, 0x00,
                               0x00, 0x00, 0xf0, 0x3d, 0x00, 0x00, 0xd0, 0x3b, 0x00, 0x50, 0x85, 0x3f,
                               0x00, 0xac, 0x0a, 0xbf, 0x00, 0x60, 0x6a, 0xbf, 0x00, 0x08, 0xcf, 0x3e};
    std::vector<std::byte> bytes;
    for (const int b : hex) bytes.push_back(static_cast<std::byte>(b));
    const auto sample = decode_imu_packet(bytes);
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->stamp_ns, 0x15488b489b6);
    EXPECT_NEAR(sample->acceleration_mps2.x(), 0.1171875 * 9.80665, 1e-6);
    EXPECT_NEAR(sample->acceleration_mps2.y(), 0.00634765625 * 9.80665, 1e-6);
    EXPECT_NEAR(sample->acceleration_mps2.z(), 1.041503906 * 9.80665, 1e-5);
    EXPECT_NEAR(sample->angular_velocity_radps.x(), -0.541687012 * 0.017453292, 1e-7);
    EXPECT_NEAR(sample->angular_velocity_radps.y(), -0.915527344 * 0.017453292, 1e-7);
    EXPECT_NEAR(sample->angular_velocity_radps.z(), 0.404357910 * 0.017453292, 1e-7);
}

TEST(Imu, SurvivesEncoding) {
    ImuSample sample;
    sample.stamp_ns = 1'700'000'000'001'300'000;
    sample.acceleration_mps2 = {0.5F, -3.0F, 9.81F};
    sample.angular_velocity_radps = {-2.0F, 0.001F, 1.0F};
    std::vector<std::byte> bytes(kLegacyImuPacketBytes);
    encode_imu_packet(bytes, sample, 5);
    const auto decoded = decode_imu_packet(bytes);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->stamp_ns, sample.stamp_ns);
    EXPECT_TRUE(decoded->acceleration_mps2.isApprox(sample.acceleration_mps2, 1e-6F));
    EXPECT_TRUE(decoded->angular_velocity_radps.isApprox(sample.angular_velocity_radps, 1e-6F));
}

TEST(Imu, WhatNoImuMeasuresIsRefused) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 600.0F, -1e30F}) {
        ImuSample sample;
        sample.acceleration_mps2.y() = bad;
        std::vector<std::byte> bytes(kLegacyImuPacketBytes);
        encode_imu_packet(bytes, sample, 0);
        EXPECT_FALSE(decode_imu_packet(bytes)) << bad;
        sample.acceleration_mps2.y() = 0.0F;
        sample.angular_velocity_radps.z() = bad;
        encode_imu_packet(bytes, sample, 0);
        EXPECT_FALSE(decode_imu_packet(bytes)) << bad;
    }
}

TEST(Imu, TimesThatNoClockShowsAreRefused) {
    constexpr std::int64_t kNoTime = std::int64_t{1} << 62U;
    for (const std::int64_t bad : {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}, kNoTime,
                                   std::numeric_limits<std::int64_t>::max()}) {
        std::vector<std::byte> bytes(kLegacyImuPacketBytes);
        encode_imu_packet(bytes, {.stamp_ns = bad}, 0);
        EXPECT_FALSE(decode_imu_packet(bytes)) << bad;
    }
    for (const std::int64_t good : {std::int64_t{0}, kNoTime - 1}) {
        std::vector<std::byte> bytes(kLegacyImuPacketBytes);
        encode_imu_packet(bytes, {.stamp_ns = good}, 0);
        ASSERT_TRUE(decode_imu_packet(bytes)) << good;
        EXPECT_EQ(decode_imu_packet(bytes)->stamp_ns, good);
    }
}

ImuSample at(std::int64_t stamp_ns) {
    ImuSample sample;
    sample.stamp_ns = stamp_ns;
    return sample;
}

TEST(ImuQueue, HandsOutInTimeOrderUpToTheStamp) {
    ImuQueue queue;
    for (const std::int64_t t : {30, 10, 20, 50, 40}) EXPECT_EQ(queue.push(at(t)), 0U);
    EXPECT_EQ(queue.push(at(20)), 1U) << "the same time twice";
    std::vector<ImuSample> out(3);
    EXPECT_EQ(queue.take(30, out), 0U);
    ASSERT_EQ(out.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(out[i].stamp_ns, 10 * (static_cast<std::int64_t>(i) + 1));
    queue.take(100, out);
    EXPECT_EQ(out.size(), 2U);
    queue.take(200, out);
    EXPECT_TRUE(out.empty());
}

TEST(ImuQueue, ThrowsAwayAbsurdTimesAndTheOldest) {
    ImuQueue queue;
    std::vector<ImuSample> out;
    const std::int64_t now = 1'000'000'000'000;
    queue.push(at(std::numeric_limits<std::int64_t>::min()));
    queue.push(at(std::numeric_limits<std::int64_t>::max()));
    queue.push(at(now - 1));
    queue.push(at(now + 1));
    EXPECT_EQ(queue.take(now, out), 2U);
    ASSERT_EQ(out.size(), 1U);
    EXPECT_EQ(out[0].stamp_ns, now - 1);
    std::uint64_t rejected = 0;
    for (int i = 0; i < 300; ++i) rejected += queue.push(at(now + 10 + i));
    EXPECT_EQ(rejected, 301U - ImuQueue::kCapacity);
    EXPECT_EQ(queue.push(at(now)), 1U) << "older than all that are kept";
    queue.take(now + 1000, out);
    ASSERT_EQ(out.size(), ImuQueue::kCapacity);
    EXPECT_EQ(out.back().stamp_ns, now + 309);
}

}  // namespace
}  // namespace dlod::driver
