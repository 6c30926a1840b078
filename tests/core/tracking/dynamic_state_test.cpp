#include "core/tracking/dynamic_state.hpp"

#include <gtest/gtest.h>

namespace dlod {
namespace {

MotionCues free_cue(int free_points, int occupied_points) {
    MotionCues c;
    c.free_points = free_points;
    c.occupied_points = occupied_points;
    c.height_m = 1.7;
    c.dt_s = 0.1;
    return c;
}

MotionCues paper_cue(double residual_m, double shift_m) {
    MotionCues c;
    c.average_residual_m = residual_m;
    c.residual_points = 20;
    c.height_m = 1.7;
    c.shift_m = shift_m;
    c.dt_s = 0.1;
    return c;
}

DynamicStateConfig paper_config() {
    DynamicStateConfig config;
    config.use_free_space = false;
    config.use_displacement = false;
    return config;
}

TEST(DynamicState, PaperRuleNeedsHitsResidualAndDisplacement) {
    const DynamicStateConfig config = paper_config();
    const double high = config.theta_res * 1.7;  // exactly theta_res * h_S (Eq. 6)
    MotionBelief all, no_residual, no_shift;
    for (int n = 1; n <= 12; ++n) {
        const bool turned = all.update(paper_cue(high, config.theta_disp_m), config);
        EXPECT_EQ(turned, n == config.n_min);
        EXPECT_EQ(all.state(), n < config.n_min ? DynamicState::kUndefined : DynamicState::kDynamic);
        no_residual.update(paper_cue(0.99 * high, 5.0), config);
        no_shift.update(paper_cue(2.0, 0.99 * config.theta_disp_m), config);
        const DynamicState waiting = n < config.n_max ? DynamicState::kUndefined : DynamicState::kStatic;
        EXPECT_EQ(no_residual.state(), waiting);
        EXPECT_EQ(no_shift.state(), waiting);
    }
    // A static one may still turn dynamic; a dynamic one stays it.
    EXPECT_TRUE(no_shift.update(paper_cue(high, 1.0), config));
    for (int n = 0; n < 100; ++n) no_shift.update(paper_cue(0.0, 1.0), config);
    EXPECT_EQ(no_shift.state(), DynamicState::kDynamic);
}

TEST(DynamicState, FreeSpaceDecidesWithinThreeFrames) {
    const DynamicStateConfig config;
    MotionBelief belief;
    int frames = 0;
    while (belief.state() != DynamicState::kDynamic && frames < 10) {
        belief.update(free_cue(60, 20), config);
        ++frames;
    }
    EXPECT_GE(frames, 2);
    EXPECT_LE(frames, 3);
}

// A slow walker of whom the map is a moment old lies in it still.
TEST(DynamicState, ALowResidualSpeaksAgainstMotionOnlyOnceThatWouldShow) {
    DynamicStateConfig config;
    MotionCues unknown;
    unknown.average_residual_m = 0.05;
    unknown.residual_points = 60;
    unknown.height_m = 1.7;
    unknown.unknown_points = 60;
    EXPECT_LT(motion_log_odds(unknown, config), -0.5 * config.residual_weight);
    unknown.residual_would_show = false;
    EXPECT_DOUBLE_EQ(motion_log_odds(unknown, config), 0.0);
}

TEST(DynamicState, WhatWasThereBeforeIsStatic) {
    const DynamicStateConfig config;
    MotionBelief belief;
    for (int n = 0; n < 10; ++n) belief.update(free_cue(2, 100), config);
    EXPECT_EQ(belief.state(), DynamicState::kStatic);
}

// A new view through an opening: unknown is neither free nor occupied.
TEST(DynamicState, TheUnknownSaysNothing) {
    const DynamicStateConfig config;
    MotionCues unknown = free_cue(0, 0);
    unknown.unknown_points = 500;
    EXPECT_EQ(motion_log_odds(unknown, config), 0.0);
    MotionCues hardly = free_cue(6, 0);
    hardly.unknown_points = 500;
    EXPECT_LT(motion_log_odds(hardly, config), 0.2);
    EXPECT_LT(free_share(unknown), 0.0);
}

TEST(DynamicState, EachCueCanBeSwitchedOff) {
    DynamicStateConfig config;
    MotionCues cues = free_cue(80, 0);
    cues.average_residual_m = 2.0;
    cues.residual_points = 10;
    cues.displacement_log_odds = 0.7;
    config.use_free_space = config.use_residual = config.use_displacement = false;
    EXPECT_EQ(motion_log_odds(cues, config), 0.0);
    config.use_displacement = true;
    EXPECT_NEAR(motion_log_odds(cues, config), 0.7 * config.displacement_weight, 1e-12);
    config.use_displacement = false;
    config.use_residual = true;
    EXPECT_NEAR(motion_log_odds(cues, config), 2.0 * config.residual_weight, 1e-12);
    config.use_residual = false;
    config.use_free_space = true;
    EXPECT_GT(motion_log_odds(cues, config), 2.0);
}

// Registration alone errs where foliage is cut into other segments each time: free space must bear it out.
TEST(DynamicState, ADisplacementCountsAsFarAsFreeSpaceBearsItOut) {
    DynamicStateConfig config;
    MotionCues contradicted = free_cue(0, 100);
    const double without = motion_log_odds(contradicted, config);
    contradicted.displacement_log_odds = 1.5;
    EXPECT_EQ(motion_log_odds(contradicted, config), without);
    MotionCues borne_out = free_cue(30, 70);
    const double before = motion_log_odds(borne_out, config);
    borne_out.displacement_log_odds = 1.5;
    EXPECT_NEAR(motion_log_odds(borne_out, config), before + 1.5, 1e-12);
}

// Who walks away enters space that he hides, and his old places look occupied: a displacement that agrees with the
// track's velocity for a while decides all the same; one that does not, never.
TEST(DynamicState, WhatWalksAwayIsFoundByItsSustainedDisplacement) {
    const DynamicStateConfig config;
    for (const bool sustained : {false, true}) {
        MotionBelief belief;
        for (int n = 0; n < 12; ++n) {
            MotionCues cues = free_cue(0, n < 4 ? 0 : 30);
            cues.unknown_points = 40;
            cues.displacement_log_odds = 1.5;
            cues.sustained_displacement = sustained && n >= 5;
            belief.update(cues, config);
        }
        EXPECT_EQ(belief.state(), sustained ? DynamicState::kDynamic : DynamicState::kStatic);
    }
}

// A door that has come to rest in its wall is predicted on; what is found there next, a chair behind it, is no door.
TEST(DynamicState, WhatIsFoundAgainMovesOnlyWhereItWasFree) {
    const DynamicStateConfig config;
    for (const bool in_free_space : {false, true}) {
        MotionBelief belief;
        for (int n = 0; n < 10; ++n) belief.update(free_cue(60, 10), config);
        ASSERT_EQ(belief.state(), DynamicState::kDynamic);
        MotionCues again = free_cue(in_free_space ? 40 : 0, 0);
        again.unknown_points = 40;
        again.dt_s = 0.9;
        belief.update(again, config);
        EXPECT_EQ(belief.state() == DynamicState::kDynamic, in_free_space);
        again.dt_s = 0.1;
        for (int n = 0; n < 5; ++n) belief.update(again, config);
        EXPECT_EQ(belief.state(), in_free_space ? DynamicState::kDynamic : DynamicState::kStatic);
    }
}

TEST(DynamicState, AMistakeIsTakenBack) {
    const DynamicStateConfig config;
    MotionBelief belief;
    for (int n = 0; n < 4; ++n) belief.update(free_cue(60, 10), config);
    ASSERT_EQ(belief.state(), DynamicState::kDynamic);
    int frames = 0;
    while (belief.state() == DynamicState::kDynamic && frames < 50) {
        belief.update(free_cue(0, 100), config);
        ++frames;
    }
    EXPECT_LT(frames, 15);
}

// The panes of a parked car show now this, now that, where earlier frames saw through them.
TEST(DynamicState, WhatStandsDoesNotMoveWhateverTheFreeSpaceSays) {
    const DynamicStateConfig config;
    MotionCues panes = free_cue(40, 60);
    MotionBelief without;
    for (int n = 0; n < 4; ++n) without.update(panes, config);
    ASSERT_EQ(without.state(), DynamicState::kDynamic);
    panes.stands = true;
    MotionBelief belief;
    for (int n = 0; n < 20; ++n) {
        belief.update(panes, config);
        EXPECT_NE(belief.state(), DynamicState::kDynamic);
    }
    // A mistake is taken back within a few frames.
    for (int n = 0; n < 5; ++n) without.update(panes, config);
    EXPECT_EQ(without.state(), DynamicState::kStatic);
}

TEST(DynamicState, WhatIsKnownToMoveAndStandsIsNoMistake) {
    const DynamicStateConfig config;
    MotionBelief belief;
    for (int n = 0; n < 35; ++n) {
        MotionCues cues = free_cue(60, 10);
        cues.position_m.x() = 0.1 * n;
        belief.update(cues, config);
    }
    ASSERT_TRUE(belief.known_to_move());
    MotionCues halt = free_cue(60, 10);
    halt.position_m.x() = 3.4;
    halt.stands = true;
    for (int n = 0; n < 20; ++n) belief.update(halt, config);
    EXPECT_EQ(belief.state(), DynamicState::kDynamic);
    for (int n = 0; n < 15; ++n) belief.update(halt, config);
    EXPECT_EQ(belief.state(), DynamicState::kStatic);
}

// More and more of a parked car comes into view: its middle goes by half of its length.
TEST(DynamicState, WhatComesIntoViewIsNotKnownToMove) {
    const DynamicStateConfig config;
    for (const double way_m : {2.2, 3.2}) {
        MotionBelief belief;
        for (int n = 0; n <= 40; ++n) {
            MotionCues cues = free_cue(60, 10);
            cues.position_m.x() = way_m * n / 40.0;
            cues.longest_m = 4.2;
            cues.dt_s = 0.1;
            belief.update(cues, config);
        }
        EXPECT_EQ(belief.state(), DynamicState::kDynamic) << way_m;
        EXPECT_EQ(belief.known_to_move(), way_m > 3.0) << way_m;
    }
}

// A bus that halts stands where it was seen a moment ago; when it sets off its side slides along itself.
TEST(DynamicState, WhatCameToRestSetsOffByItsWayAloneEvenIfThePastSpokeAgainstItSoon) {
    const DynamicStateConfig config;
    MotionBelief belief;
    double x_m = 0.0;
    const auto see = [&](const MotionCues& evidence, double step_m) {
        MotionCues cues = evidence;
        x_m += step_m;
        cues.position_m.x() = x_m;
        cues.dt_s = 0.1;
        belief.update(cues, config);
    };
    for (int n = 0; n < 30; ++n) see(free_cue(60, 10), 0.3);
    ASSERT_EQ(belief.state(), DynamicState::kDynamic);
    for (int n = 0; n < 15; ++n) see(free_cue(20, 60), 0.0);
    for (int n = 0; n < 10; ++n) see(free_cue(0, 100), 0.0);
    ASSERT_EQ(belief.state(), DynamicState::kStatic);
    for (int n = 0; n < 3; ++n) see(free_cue(0, 100), 0.2);
    EXPECT_EQ(belief.state(), DynamicState::kDynamic);
}

// He who stood for seconds has hidden the ground that he leaves, and his old place was occupied by himself.
TEST(DynamicState, WhatSetsOffIsDynamicAtOnceWhateverTheFreeSpaceSaysOfIt) {
    const DynamicStateConfig config;
    MotionBelief belief;
    const auto at = [](MotionCues cues, double x_m) {
        cues.position_m.x() = x_m;
        return cues;
    };
    for (int n = 0; n < 35; ++n) belief.update(at(free_cue(60, 10), 0.1 * n), config);
    ASSERT_TRUE(belief.known_to_move());
    for (int n = 0; n < 35; ++n) belief.update(at(free_cue(0, 100), 3.4), config);
    ASSERT_EQ(belief.state(), DynamicState::kStatic);
    MotionCues cues = at(free_cue(2, 98), 3.4);
    cues.set_off = true;
    EXPECT_TRUE(belief.update(cues, config));
    EXPECT_TRUE(belief.has_set_off());
    for (int n = 0; n < 8; ++n) belief.update(cues, config);
    EXPECT_EQ(belief.state(), DynamicState::kDynamic);
}

TEST(DynamicState, ADepartureThatLeadsNowhereIsTakenBack) {
    const DynamicStateConfig config;
    MotionBelief belief;
    for (int n = 0; n < 35; ++n) belief.update(free_cue(60, 10), config);
    for (int n = 0; n < 35; ++n) belief.update(free_cue(0, 100), config);
    MotionCues cues = free_cue(0, 100);
    cues.set_off = true;
    belief.update(cues, config);
    ASSERT_EQ(belief.state(), DynamicState::kDynamic);
    for (int n = 0; n < 5; ++n) belief.update(free_cue(0, 100), config);
    EXPECT_EQ(belief.state(), DynamicState::kStatic);
}

}  // namespace
}  // namespace dlod
