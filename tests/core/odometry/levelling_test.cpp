#include "core/odometry/levelling.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace dlod::test {
namespace {

using Next = Levelling::Next;

constexpr std::int64_t kFrame_ns = 100'000'000;

/// A body that accelerates forwards at 2 m/s^2 on level ground, in a world of which it believes that the force it felt
/// at its start points upwards.
class AcceleratedStart : public testing::Test {
  protected:
    AcceleratedStart() {
        std::array<ImuSample, 200> samples;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            samples[i].stamp_ns = static_cast<std::int64_t>(i) * 10'000'000;
            samples[i].acceleration_mps2 = Eigen::Vector3f(2.0F, 0.0F, 9.80665F);
        }
        imu_.add(samples);
        levelling_.begin_in_motion();
        levelling_.begin_map();
    }

    /// @param offset_m of the registered position along the way
    Next see(int frame, double offset_m = 0.0, bool degenerate = false) {
        const double t = 0.1 * frame;
        const Eigen::Matrix3d R = levelled(Eigen::Vector3d(2.0, 0.0, 9.80665));
        MotionFilter filter(MotionFilterConfig{}, Eigen::Isometry3d::Identity());
        filter.initialize(make_pose(Eigen::Quaterniond(R), R * Eigen::Vector3d(t * t + offset_m, 0.0, 0.0)),
                          {0.0, 0.0, -9.8}, frame * kFrame_ns, nullptr);
        return levelling_.see_scan(filter, imu_, degenerate);
    }

    ImuBuffer imu_;
    Levelling levelling_;
};

TEST_F(AcceleratedStart, TheWorldBeginsOnceTheScansShowWhereDownIs) {
    EXPECT_EQ(see(1), Next::kWait);
    EXPECT_EQ(see(2), Next::kRenewMap);
    Next next = Next::kWait;
    for (int frame = 3; frame < 10 && next == Next::kWait; ++frame) {
        EXPECT_FALSE(levelling_.known());
        next = see(frame);
    }
    ASSERT_EQ(next, Next::kBeginWorld);
    EXPECT_TRUE(levelling_.known());
    const Eigen::Vector3d down = levelled(Eigen::Vector3d(2.0, 0.0, 9.80665)) * -Eigen::Vector3d::UnitZ();
    EXPECT_LT((levelling_.gravity().mps2.normalized() - down).norm(), 0.005);
}

TEST_F(AcceleratedStart, IsMadeAgainIfTheScansDoNotMoveAsTheAccelerometerFeels) {
    int retries = 0;
    for (int start = 0; start < 5; ++start) {
        levelling_.begin_map();
        for (int frame = 1; frame < 10; ++frame) {
            const Next next = see(frame, frame % 2 == 0 ? 0.05 : -0.05);
            EXPECT_NE(next, Next::kBeginWorld);
            if (next != Next::kStartAgain) continue;
            ++retries;
            break;
        }
    }
    EXPECT_EQ(retries, 3);
    EXPECT_FALSE(levelling_.known());
}

TEST_F(AcceleratedStart, ScansAlongATunnelSayNothing) {
    for (int frame = 1; frame < 15; ++frame) EXPECT_EQ(see(frame, 0.0, true), Next::kWait);
    EXPECT_FALSE(levelling_.known());
    levelling_.give_up();
    EXPECT_TRUE(levelling_.known());
}

TEST(Levelled, TurnsADirectionUpwardsAndKeepsTheHeading) {
    const Eigen::Vector3d up = Eigen::Vector3d(0.3, -0.2, 0.9).normalized();
    const Eigen::Matrix3d R = levelled(up);
    EXPECT_LT((R * up - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(R(1, 0), 0.0, 1e-12);
    EXPECT_GT(R(0, 0), 0.0);
}

}  // namespace
}  // namespace dlod::test
