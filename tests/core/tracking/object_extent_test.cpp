#include "core/tracking/object_extent.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace dlod {
namespace {

OrientedBox box(double x, double y, double z, const Eigen::Vector3d& size_m) {
    OrientedBox b;
    b.center_m = {x, y, z};
    b.size_m = size_m;
    return b;
}

const OrientedBox kPerson = box(8.0, 0.0, -0.3, {0.5, 0.6, 1.7});

TEST(ObjectExtent, ALegOfAWalkerSaysLittleOfHisPlaceAndNothingOfHisHeight) {
    const OrientedBox leg = box(7.9, 0.2, -0.9, {0.15, 0.1, 0.5});
    const ExtentMeasurement m = complete_extent(leg, leg.size_m, kPerson, {}, true, {});
    // Inside of the person that was expected: half of the way, as it may be that part of him or his middle.
    EXPECT_NEAR(m.box.box.center_m.x(), 7.95, 1e-9);
    EXPECT_NEAR(m.box.box.center_m.y(), 0.1, 1e-9);
    EXPECT_NEAR(m.box.box.center_m.z(), -0.3, 1e-9);
    EXPECT_GT(m.box.plane_covariance(0, 0), 0.15 * 0.15);
    EXPECT_GT(m.box.plane_covariance(1, 1), 0.2 * 0.2);
    EXPECT_GT(m.box.size_sd_m.z(), 1.0);
    EXPECT_EQ(m.growth.front + m.growth.back + m.growth.left + m.growth.right, 0.0);
}

TEST(ObjectExtent, ALegThatIsOutsideMovesTheWalkerAtLeastSoThatItIsInside) {
    const OrientedBox leg = box(8.0, 0.6, -0.9, {0.2, 0.1, 0.5});
    const ExtentMeasurement m = complete_extent(leg, leg.size_m, kPerson, {}, true, {});
    EXPECT_GE(m.box.box.center_m.y() + 0.3, 0.65);
    EXPECT_LT(m.box.box.center_m.y(), 0.6);
}

TEST(ObjectExtent, AWalkerWhoIsSeenUprightIsMeasured) {
    const OrientedBox upright = box(7.9, 0.1, -0.3, {0.3, 0.6, 1.7});
    const ExtentMeasurement m = complete_extent(upright, upright.size_m, kPerson, {}, true, {});
    EXPECT_NEAR(m.box.box.center_m.x(), 8.0, 1e-9);  // the near side is seen, the depth remembered
    EXPECT_NEAR(m.box.box.center_m.y(), 0.1, 1e-9);
    EXPECT_LT(m.box.plane_covariance(1, 1), 0.1 * 0.1);
    EXPECT_LT(m.box.size_sd_m.z(), 0.2);
}

TEST(ObjectExtent, TheHeightOfWhatRestsFollowsWhatIsSeen) {
    const OrientedBox low = box(8.0, 0.0, -0.9, {0.5, 0.6, 0.5});
    EXPECT_LT(complete_extent(low, low.size_m, kPerson, {}, false, {}).box.size_sd_m.z(), 0.2);
}

TEST(ObjectExtent, WhatWasTakenForOneObjectLosesWhatIsTheOthers) {
    const OrientedBox two = box(5.0, 0.0, 0.0, {0.5, 1.2, 1.7});
    const Growth g = surplus(two, box(5.0, 0.35, 0.0, {0.5, 0.5, 1.7}));
    EXPECT_EQ(g.front, 0.0);
    EXPECT_EQ(g.back, 0.0);
    EXPECT_NEAR(g.left, 0.0, 1e-9);
    EXPECT_NEAR(g.right, -0.7, 1e-9);
}

TEST(ObjectExtent, OnlyWhatIsSeenToBeWideIsAssumedToBeAVehicle) {
    const OrientedBox wide = box(10.0, 0.0, 0.0, {0.9, 1.7, 1.5});
    EXPECT_NEAR(assumed_growth(wide, {0.9, 1.7, 1.5}, 5.0, {}).front, 3.1, 1e-9);
    EXPECT_EQ(assumed_growth(wide, {0.9, 0.5, 1.5}, 5.0, {}).front, 0.0);
}

TEST(ObjectExtent, WhatIsAsLargeAsABusFromBehindIsLongerThanACarUnlessItsSideIsSeen) {
    const OrientedBox rear = box(10.0, 0.0, 0.0, {4.0, 2.6, 2.9});
    EXPECT_NEAR(assumed_growth(rear, {0.2, 2.6, 2.9}, 8.0, {}).front, 5.0, 1e-9);
    EXPECT_EQ(assumed_growth(box(10.0, 0.0, 0.0, {6.0, 2.6, 2.9}), {6.0, 2.6, 2.9}, 8.0, {}).front, 0.0);
    EXPECT_EQ(assumed_growth(box(10.0, 0.0, 0.0, {4.0, 2.0, 2.4}), {0.2, 2.0, 2.4}, 8.0, {}).front, 0.0) << "a van";
}

// The sensor stands beside a bus and sees one side of it, most of it at a flat angle.
TEST(ObjectExtent, OfABusAlongsideTheWidthIsRemembered) {
    const OrientedBox bus = box(4.5, 2.25, 0.5, {12.0, 2.5, 3.0});
    const OrientedBox side = box(4.5, 1.1, 0.5, {12.0, 0.2, 3.0});
    const ExtentMeasurement m = complete_extent(side, side.size_m, bus, {}, true, {});
    EXPECT_NEAR(m.box.box.size_m.y(), 2.5, 1e-9);
    EXPECT_NEAR(m.box.box.center_m.y(), 2.25, 1e-9);
    EXPECT_GT(m.box.size_sd_m.y(), 1.0);
}

TEST(ObjectExtent, WhatJoinsAnObjectIsEnclosed) {
    const OrientedBox bumper = box(10.0, 0.0, 0.0, {0.4, 1.8, 0.4});
    OrientedBox windscreen = box(12.0, 0.5, 0.5, {1.6, 0.8, 0.7});
    windscreen.yaw_rad = 0.5 * std::numbers::pi;
    const Growth g = enclosing_growth(bumper, windscreen);
    EXPECT_NEAR(g.front, 2.2, 1e-9);
    EXPECT_EQ(g.back, 0.0);
    EXPECT_NEAR(g.left, 0.4, 1e-9);
    EXPECT_EQ(g.right, 0.0);
}

}  // namespace
}  // namespace dlod
