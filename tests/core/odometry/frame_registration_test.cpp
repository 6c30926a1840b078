#include "core/odometry/frame_registration.hpp"

#include <gtest/gtest.h>

namespace dlod::test {
namespace {

TEST(FrameRegistration, AScanWhoseFacadesDoNotLieWhereTheMapHasThemContradictsIt) {
    constexpr double kLeastShare = 0.1;
    const auto contradicts = [&](double fit, double seen) {
        return FrameRegistration::contradicts({.near = 2000.0, .fit = fit, .seen = seen}, kLeastShare);
    };
    EXPECT_FALSE(contradicts(80.0, 120.0));
    // All of the ground matches, and next to nothing else.
    EXPECT_TRUE(contradicts(2.0, 120.0));
    EXPECT_TRUE(contradicts(-30.0, 120.0));
    // In a field there is nothing that could tell.
    EXPECT_FALSE(contradicts(0.0, 15.0));
}

}  // namespace
}  // namespace dlod::test
