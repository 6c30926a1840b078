// What a scene is made of, ready to be scanned.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tools/sim/actor.hpp"
#include "tools/sim/robot_motion.hpp"

namespace dlod::tools::sim {

struct SceneOptions {
    std::uint64_t seed = 1;
    double duration_s = 10.0;
    bool movers = true;  ///< false: nobody moves, nobody is there
    int crowd = 0;       ///< so many people close around the robot's start
    bool buses = false;  ///< street: buses, one after the other, in the lane beside the robot
    RobotOptions robot;
};

struct World {
    Mesh still;
    std::vector<Mesh> shapes = shared_shapes();
    std::vector<std::unique_ptr<Actor>> actors;  ///< object i + 1 is actor i
    RobotMotion robot;
};

struct SceneInfo {
    std::string_view name;
    std::string_view summary;
    World (*build)(const SceneOptions&);
};

/// All scenes that there are.
const std::vector<SceneInfo>& scenes();

World build_square(const SceneOptions& options);
World build_corridor(const SceneOptions& options);
World build_street(const SceneOptions& options);
World build_circle(const SceneOptions& options);
World build_halts(const SceneOptions& options);
World build_tunnel(const SceneOptions& options);
World build_slope(const SceneOptions& options);

}  // namespace dlod::tools::sim
