#include "tools/sim/world.hpp"

namespace dlod::tools::sim {

const std::vector<SceneInfo>& scenes() {
    static const std::vector<SceneInfo> kScenes{
        {"square", "a town square: people, runners, cyclists, a dog, a road beside it", build_square},
    };
    return kScenes;
}

}  // namespace dlod::tools::sim
