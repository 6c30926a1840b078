#include "core/tracking/tracker.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/tracker_test_fixture.hpp"

namespace dlod {
namespace {

using test::Cylinder;
using test::TrackerTest;

TEST_F(TrackerTest, AWalkerIsDynamicByItsSecondOrThirdFrameAndKeepsItsId) {
    Tracker tracker(sensor, config);
    int first_dynamic = -1;
    std::set<std::uint32_t> ids;
    for (int k = 0; k < 50; ++k) {
        scene.next();
        const double x = 4.0 + 0.13 * k, y = 2.0;
        scene.add(person(x, y));
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U);
        const Track& t = scene.frame.detection.tracks[0];
        ids.insert(t.id);
        if (t.state == DynamicState::kDynamic && first_dynamic < 0) first_dynamic = k;
        EXPECT_LT((t.box.center_m.head<2>() - Eigen::Vector2d(x, y)).norm(), 0.3);
        if (k > 10) {
            EXPECT_NEAR(t.velocity_mps.x(), 1.3, 0.25);
            EXPECT_NEAR(t.velocity_mps.y(), 0.0, 0.25);
            EXPECT_NEAR(std::remainder(t.box.yaw_rad, 2.0 * 3.14159265), 0.0, 0.3);
        }
        EXPECT_EQ(scene.frame.detection.detections[0].track, 0);
    }
    EXPECT_EQ(ids, std::set<std::uint32_t>{1});
    EXPECT_GE(first_dynamic, 1);  // one frame alone never decides
    EXPECT_LE(first_dynamic, 2);
}

TEST_F(TrackerTest, APostIsStatic) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 30; ++k) {
        scene.next();
        Cylinder post = person(5.0, 0.0);
        post.moving = false;
        scene.add(post);
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U);
        EXPECT_NE(scene.frame.detection.tracks[0].state, DynamicState::kDynamic);
    }
    EXPECT_EQ(scene.frame.detection.tracks[0].state, DynamicState::kStatic);
}

TEST_F(TrackerTest, PeopleWhoMeetKeepTheirIds) {
    Tracker tracker(sensor, config);
    std::uint32_t left = 0, right = 0;
    for (int k = 0; k < 60; ++k) {
        scene.next();
        const double xl = -3.0 + 0.12 * k, xr = 4.0 - 0.12 * k;
        scene.add(person(xl, 5.0));
        scene.add(person(xr, 5.7));
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 2U);
        const auto id_of = [&](std::size_t detection) {
            return scene.frame.detection
                .tracks[static_cast<std::size_t>(scene.frame.detection.detections[detection].track)]
                .id;
        };
        if (k == 0) {
            left = id_of(0);
            right = id_of(1);
        }
        EXPECT_EQ(id_of(0), left);
        EXPECT_EQ(id_of(1), right);
    }
}

// A track without a detection has no pixels: the reference kept old ones for up to nine scans.
TEST_F(TrackerTest, AMissedTrackCoastsWithoutPixelsAndDies) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 10; ++k) {
        scene.next();
        scene.add(person(4.0 + 0.13 * k, 2.0));
        tracker.process(scene.frame);
    }
    int published = 0;
    for (int k = 10; k < 40; ++k) {
        scene.next();
        tracker.process(scene.frame);
        for (const Track& t : scene.frame.detection.tracks) {
            ++published;
            EXPECT_EQ(t.points, 0);
            EXPECT_NEAR(t.box.center_m.x(), 4.0 + 0.13 * k, 0.4);
        }
    }
    EXPECT_GE(published, 1);
    EXPECT_LE(published, config.max_misses);
    scene.next();
    scene.add(person(4.0, 2.0));
    tracker.process(scene.frame);
    EXPECT_EQ(scene.frame.detection.tracks.back().id, 2U);  // an id is never used again
}

TEST_F(TrackerTest, DynamicIsNotForEver) {
    Tracker tracker(sensor, config);
    const auto x_at = [](int k) { return 4.0 + 0.13 * std::min(k, 20) + 0.13 * std::max(0, k - 80); };
    std::map<int, DynamicState> state;
    std::set<std::uint32_t> ids;
    for (int k = 0; k < 100; ++k) {
        scene.next();
        scene.add(person(x_at(k), 2.0));  // free space was seen there before it came, and is remembered
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U);
        state[k] = scene.frame.detection.tracks[0].state;
        ids.insert(scene.frame.detection.tracks[0].id);
    }
    EXPECT_EQ(state[20], DynamicState::kDynamic);
    EXPECT_EQ(state[40], DynamicState::kDynamic);  // two seconds of rest
    EXPECT_EQ(state[70], DynamicState::kStatic);   // five
    EXPECT_EQ(state[79], DynamicState::kStatic);
    EXPECT_EQ(state[84], DynamicState::kDynamic);
    EXPECT_EQ(ids.size(), 1U);
}

TEST_F(TrackerTest, WhatIsSeenThroughAGapDoesNotMoveWithTheGap) {
    const auto ever_dynamic = [&](bool gap) {
        Tracker tracker(sensor, config);
        bool dynamic = false;
        for (int k = 0; k < 20; ++k) {
            scene.next();
            Detection& seen = scene.add(person(6.0, -1.5 + 0.15 * k));
            // Nothing was ever seen there, and little of the map is near.
            seen.unknown_points = seen.free_points + seen.occupied_points;
            seen.free_points = seen.occupied_points = 0;
            seen.occluded_left = seen.occluded_right = gap;
            tracker.process(scene.frame);
            for (const Track& t : scene.frame.detection.tracks) dynamic |= t.state == DynamicState::kDynamic;
        }
        return dynamic;
    };
    EXPECT_TRUE(ever_dynamic(false));
    EXPECT_FALSE(ever_dynamic(true));
}

TEST_F(TrackerTest, ALateDecisionHandsOutTheWholePast) {
    Tracker tracker(sensor, config);
    std::vector<OrientedBox> cleared;
    for (int k = 0; k < 30; ++k) {
        scene.next();
        Cylinder c = person(4.0 + (k > 15 ? 0.15 * (k - 15) : 0.0), 2.0);
        c.moving = k > 17;
        scene.add(c);
        tracker.process(scene.frame);
        cleared.insert(cleared.end(), scene.frame.detection.cleared.begin(), scene.frame.detection.cleared.end());
    }
    EXPECT_EQ(scene.frame.detection.tracks[0].state, DynamicState::kDynamic);
    const auto is_cleared = [&](double x) {
        return std::any_of(cleared.begin(), cleared.end(), [&](const OrientedBox& b) {
            return b.contains({x - 0.2, 1.9, 0.0}, 0.15);
        });
    };
    EXPECT_TRUE(is_cleared(4.0));
    EXPECT_TRUE(is_cleared(4.3));
    EXPECT_FALSE(is_cleared(9.0));
}

TEST_F(TrackerTest, AnInvalidPoseOnlyPredicts) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 10; ++k) {
        scene.next();
        scene.add(person(4.0 + 0.13 * k, 2.0));
        tracker.process(scene.frame);
    }
    scene.next();
    scene.frame.odometry.valid = false;
    scene.frame.odometry.T_world_sensor.translation().setConstant(1e9);
    scene.add(person(4.0, 2.0));
    tracker.process(scene.frame);
    ASSERT_EQ(scene.frame.detection.tracks.size(), 1U);
    EXPECT_NEAR(scene.frame.detection.tracks[0].box.center_m.x(), 4.0 + 0.13 * 10, 0.2);
    EXPECT_EQ(scene.frame.detection.detections[0].track, -1);
}

TEST_F(TrackerTest, TheNumberOfTracksIsBounded) {
    config.max_tracks = 5;
    Tracker tracker(sensor, config);
    for (int k = 0; k < 5; ++k) {
        scene.next();
        for (int i = 0; i < 12; ++i) scene.add(person(-12.0 + 2.0 * i, 5.0));
        tracker.process(scene.frame);
        EXPECT_EQ(scene.frame.detection.tracks.size(), 5U);
    }
}

TEST_F(TrackerTest, AVehicleAt20MetresASecondIsPickedUp) {
    Tracker tracker(sensor, config);
    std::set<std::uint32_t> ids;
    for (int k = 0; k < 20; ++k) {
        scene.next();
        Cylinder vehicle = person(-20.0 + 2.0 * k, 8.0);
        vehicle.radius_m = 1.0;
        vehicle.points = 300;
        scene.add(vehicle);
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U) << k;
        ids.insert(scene.frame.detection.tracks[0].id);
    }
    EXPECT_EQ(ids.size(), 1U);
    EXPECT_NEAR(scene.frame.detection.tracks[0].velocity_mps.x(), 20.0, 1.0);
}

TEST_F(TrackerTest, RunsAreEqualToTheByte) {
    Tracker a(sensor, config), b(sensor, config);
    for (int k = 0; k < 30; ++k) {
        scene.next();
        for (int i = 0; i < 8; ++i) scene.add(person(-5.0 + 1.3 * i + 0.05 * k * (i % 3), 4.0 + 0.1 * (i % 2) * k));
        const DetectionResult before = scene.frame.detection;
        a.process(scene.frame);
        const std::vector<Track> tracks = scene.frame.detection.tracks;
        scene.frame.detection = before;
        b.process(scene.frame);
        ASSERT_EQ(tracks.size(), scene.frame.detection.tracks.size());
        for (std::size_t i = 0; i < tracks.size(); ++i) {
            EXPECT_EQ(tracks[i].id, scene.frame.detection.tracks[i].id);
            EXPECT_EQ(tracks[i].box.center_m, scene.frame.detection.tracks[i].box.center_m);
            EXPECT_EQ(tracks[i].covariance, scene.frame.detection.tracks[i].covariance);
        }
    }
}

}  // namespace
}  // namespace dlod
