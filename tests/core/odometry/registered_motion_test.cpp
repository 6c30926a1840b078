#include "core/odometry/registered_motion.hpp"

#include <gtest/gtest.h>

namespace dlod::test {
namespace {

MotionState state(double yaw_rad, double speed_mps) {
    MotionState s;
    s.rotation = so3_exp({0.0, 0.0, yaw_rad});
    s.velocity_mps = {speed_mps, 0.0, 0.0};
    return s;
}

TEST(RegisteredMotion, IsWhatLiesBetweenTwoScans) {
    RegisteredMotion motion;
    EXPECT_FALSE(motion.see_scan(state(0.1, 1.0), 1'000'000'000).has_value());
    const auto change = motion.see_scan(state(0.15, 1.2), 1'100'000'000);
    ASSERT_TRUE(change.has_value());
    EXPECT_EQ(change->from_ns, 1'000'000'000);
    EXPECT_DOUBLE_EQ(change->duration_s, 0.1);
    EXPECT_NEAR(change->turn_rad.z(), 0.05, 1e-12);
    EXPECT_NEAR(change->velocity_mps.x(), 0.2, 1e-12);
    EXPECT_NEAR(motion.rate_radps().z(), 0.5, 1e-9);
    EXPECT_NEAR(motion.since_s(1'400'000'000), 0.3, 1e-12);
}

TEST(RegisteredMotion, AGapAndAClockThatJumpsBackSayNothing) {
    RegisteredMotion motion;
    motion.see_scan(state(0.0, 1.0), 1'000'000'000);
    motion.see_scan(state(0.1, 1.0), 1'100'000'000);
    EXPECT_FALSE(motion.see_scan(state(2.0, 1.0), 3'000'000'000).has_value());
    EXPECT_FALSE(motion.see_scan(state(2.5, 1.0), 2'000'000'000).has_value());
    EXPECT_NEAR(motion.rate_radps().z(), 1.0, 1e-9);
    EXPECT_TRUE(motion.see_scan(state(2.5, 1.0), 2'100'000'000).has_value());
}

TEST(RegisteredMotion, AWorldThatTurnsIsNoTurnOfTheBody) {
    RegisteredMotion motion;
    motion.see_scan(state(0.1, 0.0), 1'000'000'000);
    const Eigen::Quaterniond turn = so3_exp({0.2, -0.1, 1.0});
    motion.turn_world(turn.toRotationMatrix());
    MotionState next = state(0.2, 0.0);
    next.rotation = turn * next.rotation;
    const auto change = motion.see_scan(next, 1'100'000'000);
    ASSERT_TRUE(change.has_value());
    EXPECT_LT((change->turn_rad - Eigen::Vector3d(0.0, 0.0, 0.1)).norm(), 1e-12);
}

}  // namespace
}  // namespace dlod::test
