#include "core/tracking/association.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/tracking/box_iou.hpp"

namespace dlod {
namespace {

OrientedBox person_box(double x, double y) {
    OrientedBox b;
    b.center_m = {x, y, 0.0};
    b.size_m = {0.6, 0.5, 1.7};
    return b;
}

/// A filter that has seen its object stand still for a while.
KalmanFilter settled(double x, double y) {
    const KalmanConfig config;
    BoxMeasurement m;
    m.box = person_box(x, y);
    KalmanFilter filter(m, config);
    for (int i = 0; i < 20; ++i) {
        filter.predict(0.1, config);
        filter.update(m, config);
    }
    filter.predict(0.1, config);
    return filter;
}

struct Scene {
    std::vector<KalmanFilter> filters;
    std::vector<ExpectedTrack> tracks;
    std::vector<CandidateDetection> detections;

    void track(double x, double y, int points = 100, double motion = 0.0) {
        filters.reserve(1000);
        filters.push_back(settled(x, y));
        ExpectedTrack t;
        t.visible = t.whole = person_box(x, y);
        t.established = true;
        t.filter = &filters.back();
        t.points = points;
        t.dt_s = 0.1;
        t.motion = motion;
        tracks.push_back(t);
    }
    void detection(double x, double y, int points = 100, double motion = 0.0) {
        CandidateDetection d;
        d.visible = person_box(x, y);
        d.points = points;
        d.motion = motion;
        detections.push_back(d);
    }
    std::vector<int> solve(const AssociationConfig& config = {}) {
        Association association;
        return association.solve(tracks, detections, config);
    }
};

double cost(const OrientedBox& a, int points_a, const OrientedBox& b, int points_b, const AssociationConfig& config) {
    return Association::cost(box_iou(a, b), points_a, points_b, config);
}

TEST(Association, CostIsThatOfThePaper) {
    const AssociationConfig config;
    EXPECT_NEAR(cost(person_box(0, 0), 100, person_box(0, 0), 100, config), 0.0, 1e-12);
    EXPECT_NEAR(cost(person_box(0, 0), 100, person_box(0, 0), 50, config), 0.1 * 0.5, 1e-12);
    EXPECT_NEAR(cost(person_box(0, 0), 100, person_box(9, 0), 100, config), 0.8, 1e-12);
    EXPECT_NEAR(cost(person_box(0, 0), 100, person_box(0.3, 0), 25, config), 0.8 * (1.0 - 1.0 / 3.0) + 0.1 * 0.75,
                1e-12);
}

TEST(Association, OverlapDecides) {
    Scene s;
    s.track(0, 5);
    s.track(1, 5);
    s.detection(1.1, 5);
    s.detection(0.1, 5);
    EXPECT_EQ(s.solve(), (std::vector<int>{1, 0}));
}

// Assigned first and gated afterwards (a mistake of the paper's implementation), the far detection goes to the track
// with as many points, whose own detection then goes to the other track: the better match is lost to a pair that never
// was one.
TEST(Association, AFarPairStealsNoMatch) {
    Scene s;
    s.track(0.0, 5, 100);
    s.track(0.22, 5, 10);
    s.detection(0.1, 5, 50);
    s.detection(60.0, 5, 100);
    std::vector<double> ungated;
    for (const ExpectedTrack& t : s.tracks) {
        for (const CandidateDetection& d : s.detections)
            ungated.push_back(cost(t.visible, t.points, d.visible, d.points, {}));
    }
    Hungarian hungarian;
    ASSERT_EQ(hungarian.solve(ungated, 2, 2), (std::vector<int>{1, 0}));
    EXPECT_EQ(s.solve(), (std::vector<int>{0, -1}));
}

TEST(Association, TheSecondPassFindsWhatNoLongerOverlaps) {
    Scene s;
    s.track(0, 5);
    s.detection(0.75, 5);
    EXPECT_EQ(s.solve(), std::vector<int>{0});
    AssociationConfig first_only;
    first_only.second_pass = false;
    EXPECT_EQ(s.solve(first_only), std::vector<int>{-1});
}

TEST(Association, AWalkerBesideAPostDoesNotBecomeThePost) {
    Scene s;
    s.track(0.0, 5, 100, 1.0);
    s.detection(0.2, 5, 100, -1.0);  // was there before
    s.detection(-0.3, 5, 90, 1.0);
    EXPECT_EQ(s.solve(), std::vector<int>{1});
}

TEST(Association, YoungTracksReachAsFarAsTheFastestObjectsGo) {
    Scene s;
    s.track(0, 5);
    s.detection(2.0, 5);
    EXPECT_EQ(s.solve(), std::vector<int>{-1});
    s.tracks[0].young = true;
    s.tracks[0].established = false;
    EXPECT_EQ(s.solve(), std::vector<int>{0});
    s.detections[0].visible.center_m.x() = 3.0;
    EXPECT_EQ(s.solve(), std::vector<int>{-1});
}

// An object whose half was hidden is seen whole again: both halves' tracks overlap it alike.
TEST(Association, AnEstablishedTrackTakesPrecedenceOverAYoungOne) {
    Scene s;
    s.track(0.15, 5);
    s.track(-0.1, 5);
    s.tracks[1].established = false;
    s.detection(0, 5);
    EXPECT_EQ(s.solve(), (std::vector<int>{0, -1}));
}

TEST(Association, AnObjectSeenWholeAgainIsRecognisedByItsWholeBox) {
    Scene s;
    s.track(0, 5);
    s.tracks[0].visible.center_m.z() = 0.7;  // only the head was seen
    s.tracks[0].visible.size_m = {0.2, 0.2, 0.3};
    s.tracks[0].points = 5;
    s.track(0.3, 5);
    s.detection(0, 5);
    EXPECT_EQ(s.solve(), (std::vector<int>{0, -1}));
}

TEST(Association, ATrackDoesNotTakeWhatIsFarTooLarge) {
    Scene s;
    s.track(0, 5);
    s.detection(0, 5);
    s.detections[0].visible.size_m = {4.0, 3.0, 1.7};
    s.detections[0].visible.center_m.x() = 1.2;
    EXPECT_EQ(s.solve(), std::vector<int>{-1});
}

// Solving groups of competitors by themselves gives the optimum of the whole.
TEST(Association, WhatIsKnownIsKept) {
    Scene scene;
    scene.track(5.0, 0.0);
    scene.track(5.0, 0.7);
    scene.detection(5.0, 0.7);
    scene.detection(5.0, 0.0);
    Association association;
    const std::vector<int> known{0, -1};
    EXPECT_EQ(association.solve(scene.tracks, scene.detections, {}), (std::vector<int>{1, 0}));
    EXPECT_EQ(association.solve(scene.tracks, scene.detections, {}, known)[0], 0);
    EXPECT_NE(association.last()[1], 0);
}

TEST(Association, GroupsGiveTheOptimumOfTheWhole) {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> place(0.0, 12.0), shift(-0.25, 0.25);
    AssociationConfig config;
    config.second_pass = false;
    for (int trial = 0; trial < 20; ++trial) {
        Scene s;
        for (int i = 0; i < 40; ++i) {
            const double x = place(random), y = place(random);
            s.track(x, y);
            s.detection(x + shift(random), y + shift(random), 80 + i);
        }
        const std::vector<int> match = s.solve(config);
        std::vector<double> whole(40 * 40, config.unmatched_cost);
        double sum = 0.0;
        for (std::size_t t = 0; t < 40; ++t) {
            for (std::size_t d = 0; d < 40; ++d) {
                const double c = cost(s.tracks[t].visible, s.tracks[t].points, s.detections[d].visible,
                                      s.detections[d].points, config);
                if (c < config.alpha) whole[t * 40 + d] = c;
            }
            sum += match[t] >= 0 ? whole[t * 40 + static_cast<std::size_t>(match[t])] : config.unmatched_cost;
        }
        Hungarian hungarian;
        double best = 0.0;
        const std::vector<int> optimum = hungarian.solve(whole, 40, 40);
        for (std::size_t t = 0; t < 40; ++t) best += whole[t * 40 + static_cast<std::size_t>(optimum[t])];
        EXPECT_NEAR(sum, best, 1e-9);
    }
}

}  // namespace
}  // namespace dlod
