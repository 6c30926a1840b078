// Detections that cover several objects, as the tracker sees them.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/tracker_test_fixture.hpp"

namespace dlod {
namespace {

using test::Cylinder;
using MergedDetectionsTest = test::TrackerTest;

TEST_F(MergedDetectionsTest, PeopleWhoMergeInOneSegmentAreDividedAndKeepTheirIds) {
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

TEST_F(MergedDetectionsTest, PeopleWhoWalkTogetherAndMergeEverySoOftenKeepTheirIds) {
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
TEST_F(MergedDetectionsTest, PeopleOfWhomAnOccluderLeavesPiecesAboveOneAnotherStayTwo) {
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

TEST_F(MergedDetectionsTest, PeopleWhoWereNeverSeenApartAreToldApartByTheGapBetweenThem) {
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
TEST_F(MergedDetectionsTest, AWalkerIsCutOutOfTheWallThatHeMergesWith) {
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

// What earlier frames saw at the pixels of either part is the part's own, not its share of the whole.
TEST_F(MergedDetectionsTest, PartsKeepTheirOwnEvidence) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 16; ++k) {
        scene.next();
        auto walker = scene.place(person(4.0 + 0.1 * k, 2.0));
        scene.frame.detection.motion.assign(walker.size(), 1);
        if (k == 15) {
            Cylinder wall = person(4.0 + 0.1 * k + 1.3, 3.2);
            wall.radius_m = 0.8;
            const auto more = scene.place(wall);
            walker.insert(walker.end(), more.begin(), more.end());
            scene.frame.detection.motion.resize(walker.size(), -1);
        }
        scene.detect(walker, true);
        tracker.process(scene.frame);
    }
    const auto& detections = scene.frame.detection.detections;
    ASSERT_EQ(detections.size(), 2U);
    EXPECT_GT(detections[0].free_points, 100);
    EXPECT_LT(detections[0].occupied_points, 10);
    EXPECT_LT(detections[1].free_points, 10);
    EXPECT_GT(detections[1].occupied_points, 100);
}

}  // namespace
}  // namespace dlod
