#include "tools/sim/actor.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "core/types/lie.hpp"

namespace dlod::tools::sim {

std::vector<Mesh> shared_shapes() {
    std::vector<Mesh> shapes(kSharedShapes);
    shapes[kBall].add_ellipsoid(Vec3::Zero(), Vec3::Ones(), 12, Material::kPlastic);
    const std::vector<std::pair<double, double>> limb{{-0.02, 0.0}, {0.0, 0.7},  {0.08, 1.0}, {0.35, 1.05},
                                                      {0.9, 0.75},  {0.99, 0.5}, {1.02, 0.0}};
    shapes[kLimb].add_lathe(Vec3::Zero(), limb, 10, Material::kPlastic);
    const std::vector<std::pair<double, double>> torso{{-0.05, 0.0}, {0.0, 0.8},  {0.3, 0.82}, {0.7, 1.0},
                                                       {0.88, 0.92}, {0.97, 0.5}, {1.0, 0.0}};
    shapes[kTorso].add_lathe(Vec3::Zero(), torso, 14, Material::kPlastic);
    shapes[kBlock].add_box(Vec3::Zero(), Vec3::Ones(), 0.0, Material::kPlastic);
    return shapes;
}

Actor::Actor(std::string kind, Motion motion, Terrain terrain)
    : kind_(std::move(kind)), motion_(std::move(motion)), terrain_(std::move(terrain)) {}

double Actor::speed(double t) const {
    return motion_.derivative(t).head<2>().norm();
}

Eigen::Isometry3d Actor::base(double t) const {
    const Eigen::Vector4d m = motion_(t);
    return make_pose(Eigen::Quaterniond(Eigen::AngleAxisd(m[2], Vec3::UnitZ())), Vec3(m[0], m[1], ground(m[0], m[1])));
}

OrientedBox Actor::bounds(double t, const std::vector<Mesh>& shapes) const {
    std::vector<Eigen::Isometry3d> poses(parts_.size());
    place(t, poses);
    const Eigen::Isometry3d T_world_base = base(t);
    const Eigen::Isometry3d T_base_world = T_world_base.inverse();
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::max());
    Vec3 high = -low;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const Eigen::Isometry3d T = T_base_world * poses[i];
        for (const Eigen::Vector3f& v : shapes[static_cast<std::size_t>(parts_[i].shape)].vertices) {
            const Vec3 p = T * v.cast<double>().cwiseProduct(parts_[i].scale);
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
    }
    OrientedBox box;
    box.center_m = T_world_base * Vec3(0.5 * (low + high));
    box.size_m = high - low;
    box.yaw_rad = std::remainder(motion_(t)[2], 2.0 * std::numbers::pi);
    return box;
}

}  // namespace dlod::tools::sim
