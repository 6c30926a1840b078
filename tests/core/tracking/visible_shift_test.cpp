#include "core/tracking/visible_shift.hpp"

#include <gtest/gtest.h>

namespace dlod {
namespace {

OrientedBox box(double x, double y, double length, double width, double yaw_rad = 0.0) {
    OrientedBox b;
    b.center_m = Eigen::Vector3d(x, y, 1.0);
    b.size_m = Eigen::Vector3d(length, width, 1.7);
    b.yaw_rad = yaw_rad;
    return b;
}

TEST(VisibleShift, IsTheWayOfWhatKeepsItsSize) {
    EXPECT_NEAR(visible_shift_m(box(1.0, 2.0, 0.6, 0.5), box(1.9, 3.2, 0.6, 0.5)), 1.5, 1e-9);
    EXPECT_NEAR(visible_shift_m(box(1.0, 2.0, 4.5, 1.8, 0.7), box(4.0, -2.0, 4.5, 1.8, 0.7)), 5.0, 1e-9);
    EXPECT_DOUBLE_EQ(visible_shift_m(box(1.0, 2.0, 0.6, 0.5), box(1.0, 2.0, 0.6, 0.5)), 0.0);
}

TEST(VisibleShift, LimbsTakeALittleOfIt) {
    EXPECT_NEAR(visible_shift_m(box(0.0, 0.0, 0.6, 0.5), box(1.0, 0.0, 0.8, 0.5)), 0.7, 1e-9);
}

TEST(VisibleShift, IsNoneWhereMoreComesIntoView) {
    EXPECT_DOUBLE_EQ(visible_shift_m(box(0.0, 0.0, 2.0, 0.2), box(1.5, 0.0, 5.0, 0.2)), 0.0);
    EXPECT_NEAR(visible_shift_m(box(0.0, 0.0, 2.0, 0.0, 0.5), box(std::cos(0.5), std::sin(0.5), 4.0, 0.0, 0.5)), 0.0,
                1e-9)
        << "a slanted wall";
    EXPECT_DOUBLE_EQ(visible_shift_m(box(0.0, 0.0, 2.0, 0.6), box(0.0, 0.0, 0.6, 2.0)), 0.0) << "turned on the spot";
}

/// Of a wall behind an opening another part is seen from each place.
TEST(VisibleShift, IsSmallWhereAnOpeningPassesBy) {
    EXPECT_NEAR(visible_shift_m(box(0.0, 0.0, 1.0, 0.2), box(1.2, 0.0, 2.0, 0.2)), 0.0, 1e-9);
}

}  // namespace
}  // namespace dlod
