#include "tools/sim/arc_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace dlod::tools::sim {
namespace {

TEST(ArcPath, AnOpenPathBeginsAndEndsWhereItSaysAndGoesOnStraight) {
    const ArcPath path({Vec2(1, 2), Vec2(21, 2)}, false, 4.0);
    EXPECT_NEAR(path.length_m(), 20.0, 1e-9);
    EXPECT_LT((path.point(0.0) - Vec2(1, 2)).norm(), 1e-9);
    EXPECT_LT((path.point(20.0) - Vec2(21, 2)).norm(), 1e-9);
    EXPECT_LT((path.point(25.0) - Vec2(26, 2)).norm(), 1e-6);
    EXPECT_LT((path.point(-5.0) - Vec2(-4, 2)).norm(), 1e-6);
    EXPECT_NEAR(path.distance_m(Vec2(11, 5)), 3.0, 1e-3);
}

TEST(ArcPath, AClosedPathTurnsOnceAndComesBack) {
    const ArcPath path({Vec2(0, 0), Vec2(20, 0), Vec2(20, 10), Vec2(0, 10)}, true, 1.0);
    const double length = path.length_m();
    EXPECT_LT(length, 60.0);
    EXPECT_GT(length, 55.0);
    EXPECT_LT((path.point(0.3) - path.point(length + 0.3)).norm(), 1e-9);
    EXPECT_NEAR(path.heading(length + 5.0) - path.heading(5.0), 2.0 * std::numbers::pi, 1e-6);
    for (double s = 0.0; s < length; s += 0.1) {
        EXPECT_NEAR((path.point(s + 0.1) - path.point(s)).norm(), 0.1, 2e-3) << s;
    }
    EXPECT_LT(path.curvature(10.0), 1e-3);
}

}  // namespace
}  // namespace dlod::tools::sim
