#include "core/odometry/motion_iteration.hpp"

#include <gtest/gtest.h>

namespace dlod {
namespace {

/// Distance from the truth after so many steps with changes that are `gain` times what is missing, by axis.
double left_over(const Vector6d& gain, int steps) {
    Vector6d truth;
    truth << 0.6, 0.13, 0.0, 0.0, 0.01, -0.2;
    MotionIteration iteration;
    Vector6d motion = Vector6d::Zero();
    for (int i = 0; i < steps; ++i) motion = iteration.next(motion, gain.cwiseProduct(truth - motion));
    return (motion - truth).norm();
}

TEST(MotionIteration, ChangesThatGoTooFarConverge) {
    const double start = left_over(Vector6d::Ones(), 0);
    EXPECT_LT(left_over(Vector6d::Constant(3.5), 2), 1e-9) << "left to itself it would be six times as far off";
    Vector6d gain;
    gain << 1.7, 4.5, 1.0, 1.0, 2.0, 1.2;
    EXPECT_LT(left_over(gain, 4), 0.2 * start) << "left to itself it would be thirty times as far off";
}

TEST(MotionIteration, ChangesThatAreRightAreTaken) {
    EXPECT_LT(left_over(Vector6d::Ones(), 1), 1e-9);
    EXPECT_LT(left_over(Vector6d::Ones(), 4), 1e-9);
}

TEST(MotionIteration, ChangesThatFallShortAreNotExtended) {
    const double start = left_over(Vector6d::Ones(), 0);
    EXPECT_NEAR(left_over(Vector6d::Constant(0.5), 3), 0.125 * start, 1e-9);
}

}  // namespace
}  // namespace dlod
