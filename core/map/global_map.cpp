#include "core/map/global_map.hpp"

namespace dlod {

struct GlobalMap::State {};

GlobalMap::GlobalMap(const SensorModel&, const GlobalMapConfig&) : state_(std::make_unique<State>()) {}
GlobalMap::~GlobalMap() = default;
void GlobalMap::update(const Frame&) {}
void GlobalMap::finish() {}
std::vector<MapPoint> GlobalMap::points() const { return {}; }

}  // namespace dlod
