// People and animals who find their way past each other.
#pragma once

#include <vector>

#include "tools/sim/actor.hpp"
#include "tools/sim/obstacle.hpp"
#include "tools/sim/random.hpp"
#include "tools/sim/robot_motion.hpp"

namespace dlod::tools::sim {

/// How somebody walks: along a route again and again, or beside a leader.
struct Walker {
    static constexpr int kNobody = -2;
    static constexpr int kRobot = -1;

    Vec2 start = Vec2::Zero();
    double speed_mps = 1.3;
    double radius_m = 0.28;
    double agility_mps2 = 4.0;             ///< largest acceleration
    double (*stride_m)(double) = nullptr;  ///< metres a cycle of the gait at a speed
    std::vector<Vec2> route;               ///< walked in a loop
    std::vector<double> pause_s;           ///< how long to stand at each point of the route; empty: nowhere
    double reached_m = 0.7;                ///< a point of the route counts as reached
    int leader = kNobody;                  ///< index of another walker, or kRobot: walks beside
    Vec2 offset = Vec2::Zero();            ///< place beside the leader: ahead, to the left
};

/// Walks all walkers through a drive. Times before 0 give them a run-up.
/// @return their motions, valid from -1 s to a second after the end
std::vector<Motion> walk_crowd(const std::vector<Walker>& walkers, const std::vector<Obstacle>& obstacles,
                               const RobotMotion& robot, double duration_s);

}  // namespace dlod::tools::sim
