#include "core/tracking/tracker.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/synthetic_frame.hpp"

namespace dlod {
namespace {

using test::Cylinder;
using test::SyntheticFrame;

class TrackerTest : public ::testing::Test {
  protected:
    TrackerTest() : sensor(test::small_sensor()), scene(sensor) {}

    Cylinder person(double x, double y) const {
        Cylinder c;
        c.foot_m = {x, y, -1.2};
        return c;
    }
    /// The published track nearest to a place in the ground plane, or nullptr when none is within a metre.
    const Track* track_at(double x, double y) const {
        const Track* best = nullptr;
        double distance = 1.0;
        for (const Track& t : scene.frame.detection.tracks) {
            const double d = (t.box.center_m.head<2>() - Eigen::Vector2d(x, y)).norm();
            if (d < distance) {
                distance = d;
                best = &t;
            }
        }
        return best;
    }

    SensorModel sensor;
    SyntheticFrame scene;
    TrackingConfig config;
};

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

TEST_F(TrackerTest, PeopleWhoMergeInOneSegmentAreDividedAndKeepTheirIds) {
    Tracker tracker(sensor, config);
    std::map<int, std::uint32_t> id_of_person;
    for (int k = 0; k < 60; ++k) {
        scene.next();
        const double xa = -2.0 + 0.1 * k, xb = 4.0 - 0.1 * k;  // they meet at frame 30
        const auto a = scene.place(person(xa, 5.0));
        const auto b = scene.place(person(xb, 5.6));
        if (std::abs(xa - xb) < 0.8) {
            auto both = a;
            both.insert(both.end(), b.begin(), b.end());
            scene.detect(both, true);
        } else {
            scene.detect(a, true);
            scene.detect(b, true);
        }
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 2U) << k;
        const Track* ta = track_at(xa, 5.0);
        const Track* tb = track_at(xb, 5.6);
        if (k == 5) {
            id_of_person[0] = ta->id;
            id_of_person[1] = tb->id;
        }
        if (k == 59) {
            EXPECT_EQ(ta->id, id_of_person[0]);
            EXPECT_EQ(tb->id, id_of_person[1]);
        }
        std::size_t pixels = 0;
        for (const Detection& d : scene.frame.detection.detections) pixels += d.count;
        EXPECT_EQ(pixels, a.size() + b.size());
    }
}

TEST_F(TrackerTest, PeopleWhoWalkTogetherAndMergeEverySoOftenKeepTheirIds) {
    Tracker tracker(sensor, config);
    std::map<int, std::uint32_t> id_of_person;
    for (int k = 0; k < 90; ++k) {
        scene.next();
        const double x = -4.0 + 0.1 * k;
        const auto a = scene.place(person(x, 4.0));
        const auto b = scene.place(person(x + 0.1, 4.55));
        if (k % 7 < 4 && k > 5) {
            auto both = a;
            both.insert(both.end(), b.begin(), b.end());
            scene.detect(both, true);
        } else {
            scene.detect(a, true);
            if (!b.empty()) scene.detect(b, true);
        }
        tracker.process(scene.frame);
        const Track* ta = track_at(x, 4.0);
        ASSERT_NE(ta, nullptr) << k;
        if (k == 5) {
            id_of_person[0] = ta->id;
            id_of_person[1] = track_at(x + 0.1, 4.55)->id;
            ASSERT_NE(id_of_person[0], id_of_person[1]);
        }
        if (k > 5) {
            EXPECT_EQ(ta->id, id_of_person[0]) << k;
            EXPECT_EQ(track_at(x + 0.1, 4.55)->id, id_of_person[1]) << k;
        }
    }
}

// Of one the feet are left by an occluder, of the other the shoulders: that does not make them one person.
TEST_F(TrackerTest, PeopleOfWhomAnOccluderLeavesPiecesAboveOneAnotherStayTwo) {
    Tracker tracker(sensor, config);
    std::uint32_t left = 0, right = 0;
    for (int k = 0; k < 40; ++k) {
        scene.next();
        const double x = -2.0 + 0.1 * k;
        const bool hidden = k >= 25 && k < 30;
        const auto a = scene.place(person(x, 5.0));
        const auto b = scene.place(person(x + 0.05, 5.0 + (hidden ? 0.36 : 0.7)));
        // Points are placed from the feet up.
        scene.detect(hidden ? std::vector(a.begin(), a.begin() + 36) : a, true);
        scene.detect(hidden ? std::vector(b.begin() + 60, b.end()) : b, true);
        tracker.process(scene.frame);
        const auto id_of = [&](std::size_t detection) {
            const int track = scene.frame.detection.detections[detection].track;
            return track < 0 ? 0U : scene.frame.detection.tracks[static_cast<std::size_t>(track)].id;
        };
        if (k == 20) {
            left = id_of(0);
            right = id_of(1);
            ASSERT_NE(left, right);
        }
        if (k == 39) {
            EXPECT_EQ(id_of(0), left);
            EXPECT_EQ(id_of(1), right);
        }
    }
}

TEST_F(TrackerTest, PeopleWhoWereNeverSeenApartAreToldApartByTheGapBetweenThem) {
    Tracker tracker(sensor, config);
    std::set<std::uint32_t> ids;
    for (int k = 0; k < 40; ++k) {
        scene.next();
        const double x = 4.0 + 0.1 * k;
        auto both = scene.place(person(x, 2.0));
        const auto b = scene.place(person(x, 2.75));
        both.insert(both.end(), b.begin(), b.end());
        scene.detect(both, true);
        tracker.process(scene.frame);
        if (k < 10) continue;
        ASSERT_EQ(scene.frame.detection.tracks.size(), 2U) << k;
        ASSERT_NE(track_at(x, 2.0), nullptr);
        ASSERT_NE(track_at(x, 2.75), nullptr);
        for (const Track& t : scene.frame.detection.tracks) ids.insert(t.id);
    }
    EXPECT_EQ(ids.size(), 2U);
}

// A person who walks along a wall and becomes one segment with it.
TEST_F(TrackerTest, AWalkerIsCutOutOfTheWallThatHeMergesWith) {
    Tracker tracker(sensor, config);
    std::uint32_t id = 0;
    for (int k = 0; k < 30; ++k) {
        scene.next();
        const double x = 4.0 + 0.1 * k;
        auto walker = scene.place(person(x, 2.0));
        Cylinder wall = person(x + 1.3, 3.2);
        wall.moving = false;
        wall.radius_m = 0.8;
        wall.points = 150;
        if (k > 12) {
            const auto more = scene.place(wall);
            walker.insert(walker.end(), more.begin(), more.end());
        }
        scene.detect(walker, true);
        tracker.process(scene.frame);
        const Track* t = track_at(x, 2.0);
        ASSERT_NE(t, nullptr) << k;
        if (k == 5) id = t->id;
        if (k < 6) continue;
        EXPECT_EQ(t->id, id) << k;
        EXPECT_LT(t->box.size_m.head<2>().norm(), 1.2) << k;
    }
}

// The parts of an object that an occluder splits are one object.
TEST_F(TrackerTest, SplitPartsJoinTheirTrack) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 20; ++k) {
        scene.next();
        const auto all = scene.place(person(4.0 + 0.1 * k, 2.0));
        if (k < 10) {
            scene.detect(all, true);
        } else {
            scene.detect({all.begin(), all.begin() + 40}, true);
            scene.detect({all.begin() + 60, all.end()}, true);
        }
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U) << k;
        for (const Detection& d : scene.frame.detection.detections) EXPECT_EQ(d.track, 0);
    }
    EXPECT_EQ(scene.frame.detection.tracks[0].points, 100);
}

// Two walls of a house that has just come into view: the box of what is undecided holds the pavement, too.
TEST_F(TrackerTest, AWalkerIsNoPartOfAHouseThatHePasses) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 12; ++k) {
        scene.next();
        std::vector<PixelIndex> house;
        for (int i = 0; i < 8; ++i) {
            for (const auto& [x, y] : {std::pair{5.0 + i, 5.0}, std::pair{12.5, 2.0 + 0.4 * i}}) {
                Cylinder wall = person(x, y);
                wall.moving = false;
                wall.radius_m = 0.5;
                const auto part = scene.place(wall);
                house.insert(house.end(), part.begin(), part.end());
            }
        }
        Detection& undecided = scene.detect(house, false);
        undecided.unknown_points = undecided.occupied_points;
        undecided.occupied_points = 0;
        undecided.average_residual_m = 1.0;
        const double x = 9.5 - 0.13 * k;
        if (k >= 4) scene.add(person(x, 3.5));
        tracker.process(scene.frame);
        if (k < 6) continue;
        const auto& detections = scene.frame.detection.detections;
        EXPECT_NE(detections[0].track, detections[1].track) << k;
        const Track& walker = scene.frame.detection.tracks[static_cast<std::size_t>(detections[1].track)];
        EXPECT_EQ(walker.state, DynamicState::kDynamic) << k;
        EXPECT_LT(walker.box.longest_m(), 1.0) << k;
        const Track& walls = scene.frame.detection.tracks[static_cast<std::size_t>(detections[0].track)];
        EXPECT_NE(walls.state, DynamicState::kDynamic) << k;
    }
}

TEST_F(TrackerTest, AWallThatAPersonComesNearToIsNoPartOfHim) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 12; ++k) {
        scene.next();
        Detection& one = scene.add(person(4.0, 0.0));
        one.free_points = k < 11 ? 0 : 35;  // of 120: he sets off
        one.occupied_points = 120 - one.free_points;
        one.average_residual_m = 0.02;
        if (k == 11) {
            Cylinder wall = person(4.1, 0.15);
            wall.radius_m = 0.2;
            wall.moving = false;
            wall.points = 300;
            scene.add(wall);
        }
        tracker.process(scene.frame);
    }
    const auto& detections = scene.frame.detection.detections;
    ASSERT_GE(detections[0].track, 0);
    EXPECT_NE(detections[0].track, detections[1].track);
}

// Evidence divides a slow object: part of it stands where it was, part where it was not.
TEST_F(TrackerTest, TheRestOfADividedObjectStaysPartOfIt) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 20; ++k) {
        scene.next();
        const auto all = scene.place(person(4.0 + 0.1 * k, 2.0));
        if (k < 10) {
            scene.detect(all, true);
        } else {
            const std::uint32_t segment = scene.detect({all.begin(), all.begin() + 40}, true).segment;
            scene.detect({all.begin() + 40, all.end()}, false).segment = segment;
        }
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U) << k;
        EXPECT_EQ(scene.frame.detection.tracks[0].points, 120) << k;
    }
    EXPECT_EQ(scene.frame.detection.tracks[0].state, DynamicState::kDynamic);
}

// Bonnets return little: of a car that comes only bumper and windscreen are seen.
TEST_F(TrackerTest, BumperAndWindscreenAreOneTrack) {
    Tracker tracker(sensor, config);
    const auto piece = [&](double x, double z, double height_m) {
        Cylinder c;
        c.foot_m = {x, 0.0, z};
        c.radius_m = 0.8;
        c.height_m = height_m;
        return c;
    };
    for (int k = 0; k < 30; ++k) {
        scene.next();
        const double x = 25.0 - 0.4 * k;
        scene.add(piece(x, -1.0, 0.4));
        scene.add(piece(x + 1.8, -0.4, 0.6));
        tracker.process(scene.frame);
        if (k < 15) continue;
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U) << k;
        EXPECT_EQ(scene.frame.detection.tracks[0].id, 1U);
        EXPECT_GT(scene.frame.detection.tracks[0].box.size_m.x(), 2.5);
    }
}

TEST_F(TrackerTest, ADogBeforeItsOwnerKeepsItsTrack) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 30; ++k) {
        scene.next();
        const double x = 12.0 - 0.18 * k;
        Cylinder dog = person(x, 0.0);
        dog.radius_m = 0.2;
        dog.height_m = 0.6;
        scene.add(dog);
        scene.add(person(x + 1.3, 0.0));
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 2U) << k;
    }
}

// Of a car that crawls only the front stands where it was free.
TEST_F(TrackerTest, AFrontAsWideAsTheVehicleBelongsToIt) {
    const auto part = [&](double x, double radius_m) {
        Cylinder c;
        c.foot_m = {x, 0.0, -1.2};
        c.radius_m = radius_m;
        c.height_m = 1.4;
        return c;
    };
    for (const double radius_m : {0.9, 0.25}) {  // a front, a person who stands in front
        Tracker tracker(sensor, config);
        for (int k = 0; k < 24; ++k) {
            scene.next();
            auto rest = scene.place(part(8.0, 0.9));
            const auto back = scene.place(part(10.5, 0.9));
            rest.insert(rest.end(), back.begin(), back.end());
            const auto front = scene.place(part(7.2, radius_m));
            const std::uint32_t segment = scene.detect(rest, false).segment;
            if (k >= 6) scene.detect(front, true).segment = segment;
            tracker.process(scene.frame);
        }
        EXPECT_EQ(scene.frame.detection.detections[1].track == scene.frame.detection.detections[0].track,
                  radius_m > 0.5);
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
