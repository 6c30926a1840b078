#include "core/map/global_map.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/synthetic_frame.hpp"

namespace dlod {
namespace {

using test::SyntheticFrame;

/// A wall at x = 5 m that fills the image, all static.
class GlobalMapTest : public ::testing::Test {
  protected:
    GlobalMapTest() : sensor(test::small_sensor()), scene(sensor) { config.cell_m = 0.2; }

    void see_wall(double x = 5.0) {
        scene.next();
        auto& f = scene.frame;
        for (int r = 0; r < sensor.height; ++r) {
            for (int c = 0; c < sensor.width; ++c) {
                const auto i = static_cast<std::size_t>(r * sensor.width + c);
                f.odometry.x[i] = static_cast<float>(x);
                f.odometry.y[i] = 0.04F * static_cast<float>(c) - 5.0F;
                f.odometry.z[i] = 0.1F * static_cast<float>(r) - 1.5F;
                f.cloud.range_m[i] = std::hypot(f.odometry.x[i], f.odometry.y[i], f.odometry.z[i]);
                f.detection.label[i] = static_cast<std::uint8_t>(PixelLabel::kStatic);
            }
        }
    }
    int count_at(const GlobalMap& map, double x) const {
        int n = 0;
        for (const MapPoint& p : map.points()) n += std::abs(p.x - x) < 0.1;
        return n;
    }

    SensorModel sensor;
    SyntheticFrame scene;
    GlobalMapConfig config;
};

TEST_F(GlobalMapTest, FillsUpToOnePointACell) {
    GlobalMap map(sensor, config);
    for (int k = 0; k < 40; ++k) {
        see_wall();
        map.update(scene.frame);
    }
    map.finish();
    const int cells = 52 * 17;  // 10.2 m x 3.1 m of wall, ends in part
    EXPECT_GE(static_cast<int>(map.points().size()), cells - 70);
    EXPECT_LE(static_cast<int>(map.points().size()), cells);
}

TEST_F(GlobalMapTest, OnlyDecidedStaticPointsEnter) {
    GlobalMap map(sensor, config);
    for (int k = 0; k < 20; ++k) {
        see_wall();
        for (std::size_t i = 0; i < sensor.pixels(); ++i) {
            if (i % 256 < 128) {
                scene.frame.detection.label[i] =
                    static_cast<std::uint8_t>(i % 256 < 64 ? PixelLabel::kDynamic : PixelLabel::kUndecided);
            }
        }
        map.update(scene.frame);
    }
    map.finish();
    EXPECT_FALSE(map.points().empty());
    for (const MapPoint& p : map.points()) EXPECT_GE(p.y, 0.0F);
}

// The box of an object that turns dynamic clears also what was seen shortly before and has not entered yet.
TEST_F(GlobalMapTest, ThePastOfAnObjectThatTurnsDynamicGoes) {
    GlobalMap map(sensor, config);
    for (int k = 0; k < 20; ++k) {
        see_wall();
        if (k == 19) {
            OrientedBox box;
            box.center_m = {5.0, 0.0, 0.0};
            box.size_m = {1.0, 2.0, 2.0};
            scene.frame.detection.cleared.push_back(box);
        }
        map.update(scene.frame);
    }
    map.finish();
    int outside = 0;
    for (const MapPoint& p : map.points()) {
        EXPECT_FALSE(std::abs(p.y) <= 1.0F && std::abs(p.z) <= 1.0F);
        ++outside;
    }
    EXPECT_GT(outside, 500);
}

TEST_F(GlobalMapTest, FramesWithoutAPoseAndFarPointsStayOut) {
    config.max_range_m = 20.0;
    GlobalMap map(sensor, config);
    see_wall();
    scene.frame.odometry.valid = false;
    map.update(scene.frame);
    see_wall(30.0);
    scene.frame.odometry.valid = true;
    map.update(scene.frame);
    map.finish();
    EXPECT_TRUE(map.points().empty());
}

TEST_F(GlobalMapTest, AScanThatTurnsOutToBeVoidStaysOut) {
    GlobalMap map(sensor, config);
    see_wall(4.0);
    const std::int64_t first_ns = scene.frame.header.stamp_ns;
    map.update(scene.frame);
    for (int k = 0; k < 20; ++k) {
        see_wall(5.0);
        if (k == 0) scene.frame.odometry.void_scan_ns = first_ns;
        map.update(scene.frame);
        scene.frame.odometry.void_scan_ns.reset();
    }
    map.finish();
    EXPECT_EQ(count_at(map, 4.0), 0);
    EXPECT_GT(count_at(map, 5.0), 0);
}

TEST_F(GlobalMapTest, HoldsNothingThatNoFrameShowed) {
    config.confirm_s = 0.0;
    GlobalMap map(sensor, config);
    for (int k = 0; k < 3; ++k) {
        map.finish();
        for (const MapPoint& p : map.points()) EXPECT_NEAR(p.x, 5.0F, 0.01F);
        see_wall();
        map.update(scene.frame);
    }
}

TEST_F(GlobalMapTest, IsBoundedAndForgetsTheFarthest) {
    config.confirm_s = 0.0;  // each place is seen for a moment only
    config.max_points = 2000;
    GlobalMap map(sensor, config);
    for (int k = 0; k < 100; ++k) {
        scene.frame.odometry.T_world_sensor.translation().x() = 2.0 * k;
        see_wall();
        map.update(scene.frame);
    }
    map.finish();
    const auto points = map.points();
    EXPECT_LE(points.size(), 2000U);
    EXPECT_GT(points.size(), 1000U);
    EXPECT_EQ(count_at(map, 5.0), 0);
    EXPECT_GT(count_at(map, 5.0 + 2.0 * 99), 0);
}

TEST_F(GlobalMapTest, TheOrderOfPointsIsThatOfTheCells) {
    GlobalMap a(sensor, config), b(sensor, config);
    for (int k = 0; k < 16; ++k) {
        see_wall();
        a.update(scene.frame);
        b.update(scene.frame);
    }
    a.finish();
    b.finish();
    const auto pa = a.points(), pb = b.points();
    ASSERT_EQ(pa.size(), pb.size());
    for (std::size_t i = 0; i < pa.size(); ++i)
        EXPECT_TRUE(pa[i].x == pb[i].x && pa[i].y == pb[i].y && pa[i].z == pb[i].z);
}

// What passes through a place for less than confirm_s leaves no trace, even where no track has found it.
TEST_F(GlobalMapTest, WhatPassesLeavesNoTrace) {
    GlobalMap map(sensor, config);
    for (int k = 0; k < 60; ++k) {
        see_wall(k >= 20 && k < 28 ? 3.0 : 5.0);
        map.update(scene.frame);
    }
    map.finish();
    EXPECT_EQ(count_at(map, 3.0), 0);
    EXPECT_GT(count_at(map, 5.0), 700);
}

/// Of a bus only some pieces are known to be its own; the others slide along where they were.
TEST_F(GlobalMapTest, PiecesOfALargeMovingObjectLeaveNoTrace) {
    for (const bool moves : {false, true}) {
        GlobalMap map(sensor, config);
        for (int k = 0; k < 40; ++k) {
            see_wall();
            Track bus;
            bus.state = moves ? DynamicState::kDynamic : DynamicState::kUndefined;
            bus.box.center_m = {5.0, 0.0, 0.0};
            bus.box.size_m = {2.5, 12.0, 3.2};
            bus.points = 100;
            scene.frame.detection.tracks = {bus};
            map.update(scene.frame);
        }
        map.finish();
        int above_ground = 0;
        for (const MapPoint& p : map.points()) above_ground += p.z > -1.4F ? 1 : 0;
        if (moves) {
            EXPECT_EQ(above_ground, 0);
        } else {
            EXPECT_GT(above_ground, 500);
        }
    }
}

/// Nor do they where its front alone is known.
TEST_F(GlobalMapTest, WhatFollowsTheFrontOfAMovingVehicleLeavesNoTrace) {
    GlobalMap map(sensor, config);
    for (int k = 0; k < 40; ++k) {
        see_wall();
        Track front;
        front.state = DynamicState::kDynamic;
        front.box.center_m = {5.0, 4.0, 0.0};
        front.box.yaw_rad = 1.5707963;
        front.box.size_m = {4.0, 2.5, 3.2};
        front.velocity_mps = {0.0, 5.0, 0.0};
        front.points = 100;
        scene.frame.detection.tracks = {front};
        map.update(scene.frame);
    }
    map.finish();
    int above_ground = 0;
    for (const MapPoint& p : map.points()) above_ground += p.z > -1.4F ? 1 : 0;
    EXPECT_EQ(above_ground, 0);
}

}  // namespace
}  // namespace dlod
