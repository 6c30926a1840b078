#include "core/tracking/set_off.hpp"

#include <gtest/gtest.h>

namespace dlod {
namespace {

/// Forty points that see displacements in all directions alike, with a noise of 2 cm.
RegisteredDisplacement registered(double displacement_m, double stayed_m2 = 0.0004) {
    RegisteredDisplacement r;
    r.displacement_m = {displacement_m, 0.0};
    r.normals = 0.5 * Eigen::Matrix2d::Identity();
    r.points = 40;
    r.stayed_m2 = stayed_m2;
    r.moved_m2 = 0.0004;
    return r;
}

MotionCues free_of_eighty(int free) {
    MotionCues cues;
    cues.free_points = free;
    cues.occupied_points = 80 - free;
    return cues;
}

/// A second of rest.
SetOff rested(int free = 0) {
    SetOff set_off;
    for (int k = 0; k < 10; ++k) EXPECT_FALSE(set_off.update(registered(0.01), free_of_eighty(free))) << k;
    return set_off;
}

TEST(SetOff, TwoFramesOfDisplacementAreADeparture) {
    SetOff set_off = rested();
    EXPECT_FALSE(set_off.update(registered(0.08), free_of_eighty(0)));
    EXPECT_TRUE(set_off.suspected());
    EXPECT_TRUE(set_off.left_its_place());
    EXPECT_TRUE(set_off.update(registered(0.14), free_of_eighty(0)));
}

TEST(SetOff, OneFrameIsNone) {
    SetOff set_off = rested();
    for (int k = 0; k < 5; ++k) {
        EXPECT_FALSE(set_off.update(registered(0.1), free_of_eighty(0)));
        EXPECT_FALSE(set_off.update(registered(0.01), free_of_eighty(0)));
    }
}

TEST(SetOff, WhatSwaysAtItsPlaceRests) {
    SetOff set_off = rested();
    for (int k = 0; k < 20; ++k) EXPECT_FALSE(set_off.update(registered(0.04), free_of_eighty(0))) << k;
}

TEST(SetOff, ADisplacementThatTheNormalsDoNotSeeIsNone) {
    SetOff set_off = rested();
    RegisteredDisplacement along_a_wall = registered(0.2);
    along_a_wall.normals = Eigen::Vector2d(0.001, 0.999).asDiagonal();
    for (int k = 0; k < 5; ++k) EXPECT_FALSE(set_off.update(along_a_wall, free_of_eighty(0))) << k;
}

TEST(SetOff, WhoseShapeChangesSetsOff) {
    SetOff set_off = rested();
    EXPECT_FALSE(set_off.update(registered(0.0, 0.003), free_of_eighty(0)));
    EXPECT_TRUE(set_off.update(registered(0.0, 0.004), free_of_eighty(0)));
    EXPECT_FALSE(set_off.left_its_place());
}

TEST(SetOff, WhatWasSeenForAMomentHasNoPlaceToLeave) {
    SetOff set_off;
    for (int k = 0; k < 3; ++k) EXPECT_FALSE(set_off.update(registered(0.01), free_of_eighty(0)));
    for (int k = 0; k < 2; ++k) set_off.update(registered(0.2), free_of_eighty(10));
    EXPECT_FALSE(set_off.left_its_place());
}

TEST(SetOff, WhatAlwaysFitsBadlyDoesNotSetOff) {
    SetOff hedge;
    for (int k = 0; k < 40; ++k) EXPECT_FALSE(hedge.update(registered(0.02, 0.004), free_of_eighty(0))) << k;
}

TEST(SetOff, EnteringFreeSpaceIsADeparture) {
    SetOff set_off = rested();
    EXPECT_FALSE(set_off.update(registered(0.02), free_of_eighty(8)));
    EXPECT_TRUE(set_off.update(registered(0.02), free_of_eighty(12)));
}

TEST(SetOff, AnEdgeThatIsAlwaysInFreeSpaceIsNone) {
    SetOff set_off = rested(8);
    for (int k = 0; k < 20; ++k) EXPECT_FALSE(set_off.update(registered(0.02), free_of_eighty(9))) << k;
}

TEST(SetOff, TooFewPointsSayNothing) {
    SetOff set_off = rested();
    for (int k = 0; k < 5; ++k) EXPECT_FALSE(set_off.update(RegisteredDisplacement(), free_of_eighty(40))) << k;
}

}  // namespace
}  // namespace dlod
