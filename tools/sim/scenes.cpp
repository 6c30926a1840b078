#include "tools/sim/world.hpp"

namespace dlod::tools::sim {

const std::vector<SceneInfo>& scenes() {
    static const std::vector<SceneInfo> kScenes{
        {"square", "a town square: people, runners, cyclists, a dog, a road beside it", build_square},
        {"corridor", "corridors with rooms, doors that open, people who walk through them", build_corridor},
        {"street", "a street with lights, parked cars, side streets, pedestrians and cyclists", build_street},
        {"circle", "people and a dog who circle the robot, two who walk beside it", build_circle},
        {"halts", "a square and a road with a light: people and vehicles who stop and go on, again and again",
         build_halts},
        {"tunnel", "a bare tunnel between two structured ends, a few people and a van", build_tunnel},
        {"slope", "a hillside park: ramps, stairs, walls, people and a dog", build_slope},
    };
    return kScenes;
}

}  // namespace dlod::tools::sim
