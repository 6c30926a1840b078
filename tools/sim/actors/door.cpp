#include "tools/sim/actors/door.hpp"

#include <cmath>

#include "core/types/lie.hpp"

namespace dlod::tools::sim {

Door::Door(Motion motion, Terrain terrain, double width_m, double height_m)
    : Actor("door", std::move(motion), std::move(terrain)), width_m_(width_m), height_m_(height_m) {
    parts_ = {{kBlock, {width_m, 0.05, height_m}, Material::kWood}, {kBlock, {0.12, 0.16, 0.03}, Material::kMetal}};
}

void Door::place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const {
    const Eigen::Isometry3d T = base(t);
    const auto identity = Eigen::Quaterniond::Identity();
    T_world_part[0] = T * make_pose(identity, Vec3(0.5 * width_m_, 0.0, 0.5 * height_m_ + 0.01));
    T_world_part[1] = T * make_pose(identity, Vec3(width_m_ - 0.1, 0.0, 1.03));
}

double Door::speed(double t) const {
    return 0.5 * width_m_ * std::abs(motion().derivative(t)[2]);
}

}  // namespace dlod::tools::sim
