#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/odometry_run.hpp"

namespace dlod::test {
namespace {

/// A loop of 2.5 m radius at 1 m/s, after a rest.
Eigen::Isometry3d loop(double t) {
    const double a = after_rest(t) / 2.5;
    return make_pose(so3_exp({0.0, 0.0, a}), {2.5 * std::sin(a), 2.5 * (1.0 - std::cos(a)) - 1.0, 0.0});
}

class Restart : public testing::TestWithParam<bool> {
  protected:
    OdometryConfig config() const {
        OdometryConfig c;
        c.use_imu = GetParam();
        return c;
    }
};

// The map begins anew after a long gap. Keyframes of before it are still on their way then, from the detection: the new
// map must not take them in, they belong to another place.
TEST_P(Restart, TheNewMapIsNotMixedWithKeyframesOfTheOld) {
    for (const int last : {3, 4, 13}) {
        SCOPED_TRACE(last);
        SimulatedDrive drive(furnished_room(), loop);
        OdometryRun run(drive, config());
        run.run(0, last);
        run.run(75, 95);
        const std::size_t after = static_cast<std::size_t>(last);
        EXPECT_FALSE(run.frames[after].valid);
        EXPECT_TRUE(run.frames[after].flags & OdometryResult::kReinitialized);
        for (std::size_t i = after + 2; i < run.frames.size(); ++i) {
            EXPECT_TRUE(run.frames[i].valid) << i;
            EXPECT_LT(run.relative_error(after + 1, i).translation().norm(), 0.04) << i;
        }
    }
}

TEST_P(Restart, NothingIsKnownOfTheWayMeanwhile) {
    SimulatedDrive drive(furnished_room(), loop);
    OdometryRun run(drive, config());
    run.run(0, 13);
    const auto deviation = [&] { return std::sqrt(run.frames.back().covariance.topLeftCorner<3, 3>().trace()); };
    EXPECT_LT(deviation(), 0.05);
    run.run(75, 95);
    // It is as good as ever within the new map, but where that is in the world is lost.
    EXPECT_TRUE(run.frames.back().valid);
    EXPECT_GT(deviation(), 10.0);
}

INSTANTIATE_TEST_SUITE_P(Odometry, Restart, testing::Bool());

}  // namespace
}  // namespace dlod::test
