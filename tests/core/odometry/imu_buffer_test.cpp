#include "core/odometry/imu_buffer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace dlod {
namespace {

constexpr std::int64_t kMs = 1'000'000;

ImuSample sample(std::int64_t ms, float rate = 0.0F, float force = 9.8F) {
    return {ms * kMs, Eigen::Vector3f(0.0F, 0.0F, force), Eigen::Vector3f(0.0F, 0.0F, rate)};
}

int add(ImuBuffer& buffer, std::vector<ImuSample> samples) {
    return buffer.add(samples);
}

TEST(ImuBuffer, InterpolatesBetweenSamplesAndHoldsAtBothEnds) {
    ImuBuffer buffer;
    EXPECT_TRUE(buffer.empty());
    EXPECT_EQ(add(buffer, {sample(100, 0.1F), sample(110, 0.3F), sample(130, -0.1F)}), 3);
    EXPECT_EQ(buffer.oldest_ns(), 100 * kMs);
    EXPECT_EQ(buffer.newest_ns(), 130 * kMs);
    const auto rate = [&](std::int64_t ms) { return buffer.at(ms * kMs).angular_velocity_radps.z(); };
    EXPECT_NEAR(rate(50), 0.1, 1e-6);
    EXPECT_NEAR(rate(100), 0.1, 1e-6);
    EXPECT_NEAR(rate(105), 0.2, 1e-6);
    EXPECT_NEAR(rate(110), 0.3, 1e-6);
    EXPECT_NEAR(rate(120), 0.1, 1e-6);
    EXPECT_NEAR(rate(999), -0.1, 1e-6);
}

TEST(ImuBuffer, LeavesOutWhatIsNoReading) {
    ImuBuffer buffer;
    add(buffer, {sample(0)});
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinite = std::numeric_limits<float>::infinity();
    EXPECT_EQ(add(buffer, {sample(10, nan), sample(20, infinite), sample(30, 60.0F), sample(40, 0.0F, 300.0F),
                           sample(50, 0.0F, nan)}),
              0);
    EXPECT_EQ(buffer.newest_ns(), 0);
    // Out of order, or twice.
    EXPECT_EQ(add(buffer, {sample(10), sample(5), sample(10)}), 1);
    EXPECT_EQ(buffer.newest_ns(), 10 * kMs);
}

TEST(ImuBuffer, ASampleThatStandsOutCountsOnceTheNextOneBearsItOut) {
    ImuBuffer buffer;
    EXPECT_EQ(add(buffer, {sample(0, 0.1F), sample(10, 0.1F), sample(20, 9.0F)}), 2);
    EXPECT_EQ(buffer.newest_ns(), 10 * kMs);
    EXPECT_EQ(add(buffer, {sample(30, 0.2F)}), 1);
    EXPECT_NEAR(buffer.at(20 * kMs).angular_velocity_radps.z(), 0.15, 1e-6);
    // A fast turn that goes on is no spike.
    EXPECT_EQ(add(buffer, {sample(40, 5.0F), sample(50, 5.5F), sample(60, 5.0F)}), 3);
    EXPECT_NEAR(buffer.at(50 * kMs).angular_velocity_radps.z(), 5.5, 1e-6);
}

TEST(ImuBuffer, KeepsTheNewestSamples) {
    ImuBuffer buffer;
    for (int i = 0; i < 2000; ++i) ASSERT_EQ(add(buffer, {sample(10 * i, 0.001F * static_cast<float>(i))}), 1);
    EXPECT_EQ(buffer.newest_ns(), 19990 * kMs);
    EXPECT_GT(buffer.oldest_ns(), 10000 * kMs);
    for (std::int64_t t = buffer.oldest_ns(); t <= buffer.newest_ns(); t += 3 * kMs) {
        EXPECT_NEAR(buffer.at(t).angular_velocity_radps.z(), static_cast<double>(t) * 1e-10, 1e-5);
    }
    buffer.clear();
    EXPECT_TRUE(buffer.empty());
    EXPECT_EQ(add(buffer, {sample(5)}), 1);  // after a clock that has jumped back
    EXPECT_EQ(buffer.oldest_ns(), 5 * kMs);
}

TEST(ImuBuffer, TurnIsTheIntegralOfTheRate) {
    ImuBuffer buffer;
    for (int i = 0; i < 30; ++i) add(buffer, {sample(10 * i, 0.5F + 0.02F * static_cast<float>(i))});
    // 0.5 + 2 t rad/s from 50 to 150 ms.
    const double expected = 0.5 * 0.1 + (0.15 * 0.15 - 0.05 * 0.05);
    EXPECT_NEAR(buffer.turn(50 * kMs, 150 * kMs).z(), expected, 1e-5);
    EXPECT_NEAR(buffer.turn(150 * kMs, 50 * kMs).z(), -expected, 1e-5);
    EXPECT_EQ(buffer.turn(70 * kMs, 70 * kMs).norm(), 0.0);
}

}  // namespace
}  // namespace dlod
