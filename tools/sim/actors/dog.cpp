#include "tools/sim/actors/dog.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/lie.hpp"

namespace dlod::tools::sim {
namespace {

enum PartIndex { kBody, kNeck, kHead, kTail, kLegs };

Eigen::Isometry3d at(const Vec3& p, double pitch_rad = 0.0) {
    return make_pose(Eigen::Quaterniond(Eigen::AngleAxisd(pitch_rad, Vec3::UnitY())), p);
}

}  // namespace

Dog::Dog(Motion motion, Terrain terrain, Random& random)
    : Actor("dog", std::move(motion), std::move(terrain)), shoulder_m_(random.uniform(0.48, 0.68)) {
    const double s = shoulder_m_;
    parts_ = {{kBall, {0.58 * s, 0.22 * s, 0.26 * s}, Material::kFur},
              {kLimb, {0.13 * s, 0.13 * s, 0.36 * s}, Material::kFur},
              {kBall, {0.22 * s, 0.12 * s, 0.13 * s}, Material::kFur},
              {kLimb, {0.04 * s, 0.04 * s, 0.45 * s}, Material::kFur}};
    for (int i = 0; i < 4; ++i) parts_.push_back({kLimb, {0.075 * s, 0.075 * s, 0.72 * s}, Material::kFur});
}

void Dog::place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const {
    const double s = shoulder_m_;
    const Eigen::Isometry3d T = base(t);
    const double phase = motion()(t)[3];
    const double moving = std::min(1.0, Actor::speed(t) / 0.4);
    T_world_part[kBody] = T * at(Vec3(0.0, 0.0, 0.82 * s));
    T_world_part[kNeck] = T * at(Vec3(0.48 * s, 0.0, 0.9 * s), 0.6);
    T_world_part[kHead] = T * at(Vec3(0.76 * s, 0.0, 1.22 * s), 0.25);
    T_world_part[kTail] = T * at(Vec3(-0.52 * s, 0.0, 0.9 * s), -0.9 + 0.2 * std::sin(8.0 * t));
    for (int i = 0; i < 4; ++i) {
        const double x = i < 2 ? 0.38 * s : -0.38 * s;
        const double y = (i % 2 == 0 ? 0.14 : -0.14) * s;
        const bool pair = i == 0 || i == 3;  // a trot moves opposite legs together
        const double angle = moving * 0.5 * std::sin(phase + (pair ? 0.0 : std::numbers::pi));
        T_world_part[static_cast<std::size_t>(kLegs + i)] =
            T * at(Vec3(x, y, 0.74 * s), -angle) * Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitX());
    }
}

}  // namespace dlod::tools::sim
