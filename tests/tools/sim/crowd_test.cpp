#include "tools/sim/crowd.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace dlod::tools::sim {
namespace {

double stride_m(double speed_mps) {
    return 0.8 + 0.4 * speed_mps;
}

RobotMotion standing_robot() {
    const ArcPath path({Vec2(0, 0), Vec2(5, 0)}, false, 1.0);
    return {path, [](double, double) { return 0.0; }, {.speed_mps = 0.0}, 10.0};
}

Walker walker(const Vec2& from, const Vec2& to) {
    Walker w;
    w.start = from;
    w.route = {to, from};
    w.stride_m = stride_m;
    return w;
}

TEST(Crowd, PeopleWalkRoundEachOtherTheRobotAndWalls) {
    // Head-on along a line through the robot, which stands in the middle, and a wall beside.
    const std::vector<Walker> walkers{walker(Vec2(-6, 0), Vec2(6, 0)), walker(Vec2(6, 0), Vec2(-6, 0)),
                                      walker(Vec2(0, -6), Vec2(0, 6))};
    const std::vector<Obstacle> obstacles{Obstacle::wall(Vec2(-4, 2), Vec2(-1, 2), 0.2)};
    const auto motions = walk_crowd(walkers, obstacles, standing_robot(), 10.0);
    double farthest = 0.0;
    for (double t = 0.0; t < 10.0; t += 0.05) {
        for (std::size_t i = 0; i < motions.size(); ++i) {
            const Vec2 p = motions[i](t).head<2>();
            farthest = std::max(farthest, p.norm());
            EXPECT_GT(p.norm(), 0.6) << "through the robot at " << t;
            Vec2 away;
            EXPECT_GT(obstacles[0].distance_m(p, away), 0.15) << "through the wall at " << t;
            EXPECT_LT(motions[i].derivative(t).head<2>().norm(), 2.5);
            for (std::size_t j = 0; j < i; ++j) EXPECT_GT((p - motions[j](t).head<2>()).norm(), 0.35) << t;
        }
    }
    EXPECT_GT(farthest, 4.0);
}

TEST(Crowd, WhoPausesStandsStillAndGoesOn) {
    Walker w = walker(Vec2(3, 3), Vec2(3, 3));
    w.route = {Vec2(3, 3), Vec2(8, 3)};
    w.pause_s = {7.0, 0.0};  // the run-up of 4 s counts
    const auto motions = walk_crowd({w}, {}, standing_robot(), 6.0);
    EXPECT_LT(motions[0].derivative(1.0).head<2>().norm(), 0.01);
    EXPECT_GT(motions[0].derivative(5.0).head<2>().norm(), 0.8);
}

TEST(Crowd, CompanionsStayBesideTheirLeader) {
    Walker companion;
    companion.leader = 0;
    companion.offset = Vec2(0.0, 0.7);
    companion.stride_m = stride_m;
    const auto motions = walk_crowd({walker(Vec2(-8, 4), Vec2(8, 4)), companion}, {}, standing_robot(), 6.0);
    for (double t = 2.0; t < 6.0; t += 0.1) {
        EXPECT_NEAR((motions[0](t) - motions[1](t)).head<2>().norm(), 0.7, 0.35) << t;
    }
}

}  // namespace
}  // namespace dlod::tools::sim
