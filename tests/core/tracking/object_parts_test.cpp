// Detections that are parts of an object, and such as only seem to be.
#include <gtest/gtest.h>

#include "tests/support/tracker_test_fixture.hpp"

namespace dlod {
namespace {

using test::Cylinder;
using ObjectPartsTest = test::TrackerTest;

// The parts of an object that an occluder splits are one object.
TEST_F(ObjectPartsTest, SplitPartsJoinTheirTrack) {
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
TEST_F(ObjectPartsTest, AWalkerIsNoPartOfAHouseThatHePasses) {
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

TEST_F(ObjectPartsTest, AWallThatAPersonComesNearToIsNoPartOfHim) {
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
TEST_F(ObjectPartsTest, TheRestOfADividedObjectStaysPartOfIt) {
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

// Of a bus that accelerates the rear, which stands where the bus itself was not, is found beyond the expected box.
TEST_F(ObjectPartsTest, APartOfTheSegmentThatMovesBelongsToTheObjectEvenIfItIsOutsideOfItsBox) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 12; ++k) {
        scene.next();
        const double x = 15.0 - 0.6 * k;
        std::vector<PixelIndex> front;
        for (const double at_m : {0.0, 2.0, 4.0}) {
            const auto part = scene.place(body({x + at_m, 4.0, -1.2}, 0.9, 2.5));
            front.insert(front.end(), part.begin(), part.end());
        }
        const std::uint32_t segment = scene.detect(front, k < 11).segment;
        if (k == 11) scene.detect(scene.place(body({x + 4.8, 4.0, -1.2}, 0.1, 2.0)), true).segment = segment;
        tracker.process(scene.frame);
    }
    EXPECT_EQ(scene.frame.detection.detections[1].track, scene.frame.detection.detections[0].track);
    EXPECT_EQ(scene.frame.detection.tracks.size(), 1U);
}

// Of a bus that crawls behind a post the rear side lies where the bus was a moment ago, and is seen by itself.
TEST_F(ObjectPartsTest, TheRearOfABusThatCrawlsIsPartOfIt) {
    Tracker tracker(sensor, config);
    double front_x = 0.0;
    for (int k = 0; k < 40; ++k) {
        scene.next();
        front_x += k < 20 ? 0.4 : 0.05;
        std::vector<PixelIndex> front, rear;
        for (int i = 0; i < 9; ++i) {
            Cylinder slice = body({front_x - i, 12.0, -1.2}, 0.6, 2.5);
            slice.points = 40;
            auto& part = i < 4 ? front : rear;
            const auto pixels = scene.place(slice);
            part.insert(part.end(), pixels.begin(), pixels.end());
        }
        const bool apart = k >= 30;
        if (!apart) front.insert(front.end(), rear.begin(), rear.end());
        scene.detect(front, true);
        if (apart) scene.detect(rear, false);
        tracker.process(scene.frame);
        if (k < 12) continue;
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U) << k;
        EXPECT_EQ(scene.frame.detection.tracks[0].state, DynamicState::kDynamic) << k;
        for (const Detection& d : scene.frame.detection.detections) EXPECT_EQ(d.track, 0) << k;
        // Whatever of it has become part of the map is cleared.
        EXPECT_EQ(scene.frame.detection.cleared.size(), apart ? 1U : 0U) << k;
    }
}

// He is within the outline that a vehicle is believed to have, and goes on about as fast.
TEST_F(ObjectPartsTest, WhoIsOvertakenCloselyIsNoPartOfTheVehicle) {
    Tracker tracker(sensor, config);
    std::uint32_t walker = 0;
    for (int k = 0; k < 45; ++k) {
        scene.next();
        const double x = 8.0 + 0.09 * k;
        const int of_walker = static_cast<int>(scene.frame.detection.detections.size());
        scene.add(person(x, 6.0));
        if (k >= 15) {
            std::vector<PixelIndex> vehicle;
            for (int i = 0; i < 4; ++i) {
                const double front_x = x - 1.0 + 0.08 * (k - 15);
                const auto part = scene.place(body({front_x - 1.0 * i, 6.9, -1.2}, 0.9, 1.6));
                vehicle.insert(vehicle.end(), part.begin(), part.end());
            }
            scene.detect(vehicle, true);
        }
        tracker.process(scene.frame);
        const int track = scene.frame.detection.detections[static_cast<std::size_t>(of_walker)].track;
        ASSERT_GE(track, 0) << k;
        const std::uint32_t id = scene.frame.detection.tracks[static_cast<std::size_t>(track)].id;
        if (k == 14) walker = id;
        ASSERT_TRUE(k < 15 || id == walker) << k;
    }
}

// Bonnets return little: of a car that comes only bumper and windscreen are seen.
TEST_F(ObjectPartsTest, BumperAndWindscreenAreOneTrack) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 30; ++k) {
        scene.next();
        const double x = 25.0 - 0.4 * k;
        scene.add(body({x, 0.0, -1.0}, 0.8, 0.4));
        scene.add(body({x + 1.8, 0.0, -0.4}, 0.8, 0.6));
        tracker.process(scene.frame);
        if (k < 15) continue;
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U) << k;
        EXPECT_EQ(scene.frame.detection.tracks[0].id, 1U);
        EXPECT_GT(scene.frame.detection.tracks[0].box.size_m.x(), 2.5);
    }
}

// Seats and the rear panel of a van, through its windscreen: too far behind its front to be a piece of a car.
TEST_F(ObjectPartsTest, WhatIsSeenThroughTheWindscreenBelongsToTheVan) {
    struct Case {
        double y_m, top_m;
        std::size_t tracks;
    };
    // Within the van's outline; beside it, as one who drives along; above it.
    for (const Case& inner : {Case{0.0, 0.5, 1}, Case{3.0, 0.5, 2}, Case{0.0, 1.4, 2}}) {
        Tracker tracker(sensor, config);
        for (int k = 0; k < 30; ++k) {
            scene.next();
            const double x = 25.0 - 0.5 * k;
            scene.add(body({x, 0.0, -1.2}, 0.9, 2.0));
            scene.add(body({x + 5.0, inner.y_m, inner.top_m - 0.5}, 0.4, 0.5));
            tracker.process(scene.frame);
        }
        EXPECT_EQ(scene.frame.detection.tracks.size(), inner.tracks) << inner.y_m << ' ' << inner.top_m;
    }
}

// Of a vehicle that comes into view from behind another one these pieces are seen, then those; from the fourth frame on
// its velocity says which are its own.
TEST_F(ObjectPartsTest, PiecesOfAVehicleThatComesIntoViewAreOneTrack) {
    Tracker tracker(sensor, config);
    const auto add_piece = [&](double x, double y, double height_m) { scene.add(body({x, y, -1.2}, 0.5, height_m)); };
    for (int k = 0; k < 4; ++k) {
        scene.next();
        const double x = 30.0 - 1.0 * k;
        add_piece(x + (k % 2 == 0 ? 0.0 : 1.2), 0.0, 0.6);
        if (k > 0) add_piece(x + 2.0, k % 2 == 0 ? -0.6 : 0.6, 0.7);
        if (k > 1) add_piece(x + 3.4, 0.3, 0.5);
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 1U) << k;
        EXPECT_EQ(scene.frame.detection.tracks[0].id, 1U) << k;
    }
}

TEST_F(ObjectPartsTest, PeopleWhoComeIntoViewTogetherAreNoPieces) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 8; ++k) {
        scene.next();
        for (const double y : {-0.9, 0.0, 0.9}) scene.add(person(12.0 - 0.13 * k, y));
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 3U) << k;
    }
}

TEST_F(ObjectPartsTest, ADogBeforeItsOwnerKeepsItsTrack) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 30; ++k) {
        scene.next();
        const double x = 12.0 - 0.18 * k;
        scene.add(body({x, 0.0, -1.2}, 0.2, 0.6));
        scene.add(person(x + 1.3, 0.0));
        tracker.process(scene.frame);
        ASSERT_EQ(scene.frame.detection.tracks.size(), 2U) << k;
    }
}

// Of a car that crawls only the front stands where it was free.
TEST_F(ObjectPartsTest, AFrontAsWideAsTheVehicleBelongsToIt) {
    const auto part = [&](double x, double radius_m) { return body({x, 0.0, -1.2}, radius_m, 1.4); };
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

// A car that leaves a row of parked ones is known as a whole when its rear becomes one segment with one of them.
TEST_F(ObjectPartsTest, AWholeVehicleIsNoFrontOfAParkedOne) {
    Tracker tracker(sensor, config);
    const auto car = [&](double x, double y, int pieces) {
        std::vector<PixelIndex> all;
        for (int i = 0; i < pieces; ++i) {
            const auto part = scene.place(body({x + 1.2 * i, y, -1.2}, 0.9, 1.4));
            all.insert(all.end(), part.begin(), part.end());
        }
        return all;
    };
    for (int k = 0; k < 24; ++k) {
        scene.next();
        const std::uint32_t segment = scene.detect(car(3.6, 4.0, 2), false).segment;
        Detection& driving = scene.detect(car(5.2 + 0.06 * k, 4.2, k < 23 ? 3 : 1), true);
        if (k == 23) driving.segment = segment;
        tracker.process(scene.frame);
    }
    const auto& detections = scene.frame.detection.detections;
    EXPECT_NE(detections[0].track, detections[1].track);
}

// Splinters are tested to the last pixel, of what they belong to some are.
TEST_F(ObjectPartsTest, SplintersSpeakForTheirPixelsOnly) {
    Tracker tracker(sensor, config);
    for (int k = 0; k < 10; ++k) {
        scene.next();
        Cylinder parked = body({5.0, 0.0, -1.2}, 0.9, 1.4);
        parked.points = 2400;
        Detection& car = scene.detect(scene.place(parked), false);
        car.occupied_points = 4;
        car.unknown_points = 56;
        car.residual_points = 0;
        for (const double y : {-0.4, 0.0, 0.4}) {
            if (k < 4) break;
            Cylinder splinter = body({4.6, y, -0.2}, 0.15, 0.2);
            splinter.points = 30;
            Detection& pane = scene.detect(scene.place(splinter), true);
            pane.free_points = 30;
            pane.occupied_points = 0;
            pane.average_residual_m = 0.02;
        }
        tracker.process(scene.frame);
    }
    const Track& car =
        scene.frame.detection.tracks[static_cast<std::size_t>(scene.frame.detection.detections[0].track)];
    EXPECT_NE(car.state, DynamicState::kDynamic);
}

}  // namespace
}  // namespace dlod
