#include "tools/sim/props.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/lie.hpp"
#include "tools/sim/actors/cyclist.hpp"
#include "tools/sim/actors/vehicle.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

Eigen::Isometry3d frame_at(const Vec3& base, double yaw_rad) {
    return make_pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Vec3::UnitZ())), base);
}

Vec3 up(double z) {
    return {0.0, 0.0, z};
}

/// Boxes given in the frame of a prop: middle, size.
class Assembly {
  public:
    Assembly(Mesh& mesh, const Vec3& base, double yaw_rad) : mesh_(mesh), T_(frame_at(base, yaw_rad)) {}
    void box(const Vec3& center, const Vec3& size, Material material) {
        mesh_.add_box(T_ * make_pose(Eigen::Quaterniond::Identity(), center), size, material);
    }
    void bar(const Vec3& a, const Vec3& b, double radius, Material material) {
        mesh_.add_bar(T_ * a, T_ * b, radius, material);
    }

  private:
    Mesh& mesh_;
    Eigen::Isometry3d T_;
};

Vec3 random_direction(Random& random) {
    const double z = random.uniform(-1.0, 1.0);
    const double angle = random.uniform(0.0, kTurn);
    const double r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace

void add_leaves(Mesh& mesh, Random& random, const Vec3& center, const Vec3& radii_m, int count, double size_m) {
    for (int i = 0; i < count; ++i) {
        const double share = std::cbrt(random.uniform(0.15, 1.0));
        const Vec3 p = center + share * random_direction(random).cwiseProduct(radii_m);
        const Vec3 a = random_direction(random) * size_m * random.uniform(0.5, 1.3);
        const Vec3 b = random_direction(random) * size_m * random.uniform(0.5, 1.3);
        mesh.add_triangle(p, p + a, p + b, Material::kFoliage);
    }
}

void add_tree(Stage stage, const Vec3& base) {
    Random& random = stage.random;
    const double trunk = random.uniform(2.0, 3.2);
    const double radius = random.uniform(0.11, 0.24);
    const double crown = random.uniform(1.4, 2.6);
    const Vec3 lean(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), 0.0);
    const Vec3 fork = base + up(trunk) + lean;
    stage.mesh.add_bar(base - up(0.1), fork, radius, Material::kBark, 10);
    const Vec3 top = fork + up(0.75 * crown);
    for (int i = 0; i < 5; ++i) {
        const double angle = kTurn * (i + random.uniform()) / 5.0;
        const Vec3 end = top + Vec3(std::cos(angle), std::sin(angle), random.uniform(-0.3, 0.5)) * 0.6 * crown;
        stage.mesh.add_bar(fork, end, 0.3 * radius, Material::kBark, 6);
    }
    add_leaves(stage.mesh, random, top, Vec3(crown, crown, 0.85 * crown), static_cast<int>(420 * crown), 0.28);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), radius + 0.1));
}

void add_bush(Stage stage, const Vec3& base, double radius_m) {
    add_leaves(stage.mesh, stage.random, base + up(0.6 * radius_m), Vec3(radius_m, radius_m, 0.75 * radius_m),
               static_cast<int>(650 * radius_m * radius_m) + 60, 0.16);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), radius_m));
}

void add_hedge(Stage stage, const Vec3& from, const Vec3& to, double height_m) {
    const Vec3 d = to - from;
    const int clumps = std::max(1, static_cast<int>(d.norm() / 0.5));
    for (int i = 0; i <= clumps; ++i) {
        add_leaves(stage.mesh, stage.random, from + d * (static_cast<double>(i) / clumps) + up(0.5 * height_m),
                   Vec3(0.4, 0.4, 0.55 * height_m), 70, 0.14);
    }
    stage.obstacles.push_back(Obstacle::wall(from.head<2>(), to.head<2>(), 0.8));
}

void add_bench(Stage stage, const Vec3& base, double yaw_rad) {
    Assembly a(stage.mesh, base, yaw_rad);
    for (int i = 0; i < 4; ++i) a.box(Vec3(-0.2 + 0.13 * i, 0.0, 0.45), Vec3(0.1, 1.8, 0.04), Material::kWood);
    for (int i = 0; i < 3; ++i) a.box(Vec3(-0.3, 0.0, 0.58 + 0.13 * i), Vec3(0.04, 1.8, 0.09), Material::kWood);
    for (const double y : {-0.75, 0.75}) {
        a.box(Vec3(-0.28, y, 0.42), Vec3(0.06, 0.06, 0.86), Material::kMetal);
        a.box(Vec3(0.2, y, 0.22), Vec3(0.06, 0.06, 0.44), Material::kMetal);
        a.box(Vec3(-0.02, y, 0.64), Vec3(0.48, 0.05, 0.04), Material::kMetal);
    }
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), Vec2(0.7, 1.9), yaw_rad));
}

void add_lamp_post(Stage stage, const Vec3& base) {
    const double height = stage.random.uniform(3.6, 5.5);
    stage.mesh.add_bar(base, base + up(0.8), 0.11, Material::kMetal);
    stage.mesh.add_bar(base + up(0.8), base + up(height), 0.055, Material::kMetal);
    stage.mesh.add_ellipsoid(base + up(height + 0.2), Vec3(0.22, 0.22, 0.26), 10, Material::kPlastic);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 0.12));
}

void add_bollard(Stage stage, const Vec3& base) {
    const double height = stage.random.uniform(0.75, 1.05);
    stage.mesh.add_bar(base, base + up(height), 0.085, Material::kMetal, 10);
    stage.mesh.add_ellipsoid(base + up(height), Vec3(0.1, 0.1, 0.08), 8, Material::kLightPaint);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 0.12));
}

void add_bin(Stage stage, const Vec3& base) {
    stage.mesh.add_bar(base + up(0.05), base + up(0.95), stage.random.uniform(0.22, 0.32), Material::kPlastic, 14);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 0.32));
}

void add_planter(Stage stage, const Vec3& base, double yaw_rad) {
    Assembly a(stage.mesh, base, yaw_rad);
    a.box(up(0.28), Vec3(1.6, 0.7, 0.56), Material::kConcrete);
    for (const double x : {-0.45, 0.0, 0.45}) {
        const Vec3 p = frame_at(base, yaw_rad) * Vec3(x, 0.0, 0.8);
        add_leaves(stage.mesh, stage.random, p, Vec3(0.4, 0.38, 0.4), 90, 0.13);
    }
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), Vec2(1.6, 0.8), yaw_rad));
}

void add_fountain(Stage stage, const Vec3& base) {
    const std::vector<std::pair<double, double>> basin{{0.0, 2.3}, {0.5, 2.3}, {0.5, 2.0}, {0.25, 1.95}, {0.25, 0.0}};
    stage.mesh.add_lathe(base, basin, 28, Material::kConcrete);
    const std::vector<std::pair<double, double>> column{{0.0, 0.5},   {0.4, 0.35}, {1.3, 0.22}, {1.5, 0.9},
                                                        {1.65, 0.95}, {1.6, 0.2},  {2.3, 0.1},  {2.4, 0.0}};
    stage.mesh.add_lathe(base, column, 16, Material::kConcrete);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 2.35));
}

void add_kiosk(Stage stage, const Vec3& base, double yaw_rad) {
    Assembly a(stage.mesh, base, yaw_rad);
    a.box(up(1.2), Vec3(2.4, 2.0, 2.4), Material::kLightPaint);
    a.box(up(2.5), Vec3(3.4, 2.8, 0.12), Material::kPlastic);
    a.box(Vec3(1.45, 0.0, 1.0), Vec3(0.5, 1.6, 0.06), Material::kWood);
    for (const double y : {-1.25, 1.25}) a.bar(Vec3(1.6, y, 0.0), Vec3(1.6, y, 2.45), 0.03, Material::kMetal);
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), Vec2(3.4, 2.6), yaw_rad));
}

void add_cafe_table(Stage stage, const Vec3& base, bool umbrella) {
    Random& random = stage.random;
    stage.mesh.add_bar(base, base + up(0.72), 0.035, Material::kMetal);
    stage.mesh.add_bar(base + up(0.71), base + up(0.745), 0.42, Material::kLightPaint, 14);
    if (umbrella) {
        stage.mesh.add_bar(base + up(0.7), base + up(2.5), 0.025, Material::kWood);
        const std::vector<std::pair<double, double>> cloth{{0.0, 1.5}, {0.55, 0.0}};
        stage.mesh.add_lathe(base + up(2.05), cloth, 8, Material::kLightCloth);
    }
    const int chairs = random.integer(2, 4);
    for (int i = 0; i < chairs; ++i) {
        const double angle = kTurn * (i + random.uniform(-0.2, 0.2)) / chairs;
        const Vec3 p = base + Vec3(std::cos(angle), std::sin(angle), 0.0) * random.uniform(0.65, 0.9);
        Assembly chair(stage.mesh, p, angle + std::numbers::pi + random.uniform(-0.4, 0.4));
        chair.box(up(0.45), Vec3(0.42, 0.42, 0.03), Material::kWood);
        chair.box(Vec3(-0.2, 0.0, 0.68), Vec3(0.03, 0.42, 0.4), Material::kWood);
        for (const double x : {-0.19, 0.19}) {
            for (const double y : {-0.19, 0.19}) chair.bar(Vec3(x, y, 0.0), Vec3(x, y, 0.45), 0.014, Material::kMetal);
        }
    }
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 1.15));
}

void add_sign(Stage stage, const Vec3& base, double yaw_rad) {
    Assembly a(stage.mesh, base, yaw_rad);
    a.bar(Vec3::Zero(), up(2.6), 0.03, Material::kMetal);
    a.box(Vec3(0.04, 0.0, 2.3), Vec3(0.02, 0.6, 0.6), Material::kRetroreflector);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 0.1));
}

void add_traffic_light(Stage stage, const Vec3& base, double yaw_rad) {
    Assembly a(stage.mesh, base, yaw_rad);
    a.bar(Vec3::Zero(), up(3.2), 0.06, Material::kMetal);
    a.box(Vec3(0.12, 0.0, 2.7), Vec3(0.22, 0.3, 0.9), Material::kPlastic);
    a.box(Vec3(0.05, 0.0, 1.1), Vec3(0.1, 0.12, 0.2), Material::kPlastic);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 0.15));
}

void add_parked_bicycle(Stage stage, const Vec3& base, double yaw_rad) {
    const Eigen::Affine3d T(frame_at(base, yaw_rad) * Eigen::AngleAxisd(0.12, Vec3::UnitX()));
    stage.mesh.append(bicycle_frame_mesh(), T);
    const Mesh wheel = bicycle_wheel_mesh();
    for (const double x : {-0.525, 0.525}) stage.mesh.append(wheel, T * Eigen::Translation3d(x, 0.0, 0.335));
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), Vec2(1.8, 0.5), yaw_rad));
}

void add_parked_car(Stage stage, const Vec3& base, double yaw_rad) {
    const bool van = stage.random.chance(0.2);
    const Mesh car = van ? van_mesh(stage.random) : car_mesh(stage.random);
    stage.mesh.append(car, Eigen::Affine3d(frame_at(base, yaw_rad)));
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), van ? Vec2(5.8, 2.1) : Vec2(4.6, 1.9), yaw_rad));
}

void add_statue(Stage stage, const Vec3& base) {
    Assembly a(stage.mesh, base, stage.random.uniform(0.0, kTurn));
    a.box(up(0.5), Vec3(1.2, 1.2, 1.0), Material::kConcrete);
    // A person of stone: as large, and never moving.
    stage.mesh.add_ellipsoid(base + up(2.1), Vec3(0.2, 0.26, 0.4), 12, Material::kConcrete);
    stage.mesh.add_ellipsoid(base + up(2.68), Vec3(0.13, 0.12, 0.16), 10, Material::kConcrete);
    for (const double y : {-0.11, 0.11}) a.bar(Vec3(0.0, y, 1.0), Vec3(0.0, y, 1.85), 0.1, Material::kConcrete);
    a.bar(Vec3(0.0, 0.25, 2.35), Vec3(0.35, 0.45, 2.0), 0.06, Material::kConcrete);
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), Vec2(1.3, 1.3), 0.0));
}

void add_desk_and_chair(Stage stage, const Vec3& base, double yaw_rad) {
    Assembly a(stage.mesh, base, yaw_rad);
    a.box(up(0.73), Vec3(0.8, 1.6, 0.04), Material::kWood);
    for (const double x : {-0.36, 0.36}) {
        for (const double y : {-0.75, 0.75}) a.bar(Vec3(x, y, 0.0), Vec3(x, y, 0.72), 0.025, Material::kMetal);
    }
    a.box(Vec3(-0.2, 0.1, 1.0), Vec3(0.05, 0.55, 0.33), Material::kPlastic);
    const double x = stage.random.uniform(0.55, 0.85);
    a.box(Vec3(x, 0.0, 0.46), Vec3(0.46, 0.46, 0.06), Material::kDarkCloth);
    a.box(Vec3(x + 0.24, 0.0, 0.75), Vec3(0.05, 0.44, 0.5), Material::kDarkCloth);
    a.bar(Vec3(x, 0.0, 0.08), Vec3(x, 0.0, 0.45), 0.03, Material::kMetal);
    a.box(Vec3(x, 0.0, 0.07), Vec3(0.55, 0.06, 0.04), Material::kPlastic);
    a.box(Vec3(x, 0.0, 0.07), Vec3(0.06, 0.55, 0.04), Material::kPlastic);
    stage.obstacles.push_back(
        Obstacle::box(base.head<2>() + Eigen::Rotation2Dd(yaw_rad) * Vec2(0.35, 0.0), Vec2(1.6, 1.6), yaw_rad));
}

void add_cabinet(Stage stage, const Vec3& base, double yaw_rad) {
    const double height = stage.random.uniform(0.9, 2.0);
    Assembly(stage.mesh, base, yaw_rad).box(up(0.5 * height), Vec3(0.42, 1.0, height), Material::kLightPaint);
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), Vec2(0.45, 1.0), yaw_rad));
}

void add_plant(Stage stage, const Vec3& base) {
    const std::vector<std::pair<double, double>> pot{{0.0, 0.14}, {0.32, 0.19}, {0.3, 0.0}};
    stage.mesh.add_lathe(base, pot, 10, Material::kConcrete);
    add_leaves(stage.mesh, stage.random, base + up(0.85), Vec3(0.35, 0.35, 0.5), 130, 0.16);
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 0.3));
}

void add_sofa(Stage stage, const Vec3& base, double yaw_rad) {
    Assembly a(stage.mesh, base, yaw_rad);
    a.box(Vec3(0.05, 0.0, 0.25), Vec3(0.75, 1.8, 0.4), Material::kMediumCloth);
    a.box(Vec3(-0.35, 0.0, 0.5), Vec3(0.2, 1.8, 0.8), Material::kMediumCloth);
    for (const double y : {-0.95, 0.95}) a.box(Vec3(0.0, y, 0.35), Vec3(0.85, 0.15, 0.6), Material::kMediumCloth);
    stage.obstacles.push_back(Obstacle::box(base.head<2>(), Vec2(0.95, 2.1), yaw_rad));
}

void add_boxes(Stage stage, const Vec3& base) {
    double z = 0.0;
    for (int i = stage.random.integer(1, 3); i > 0; --i) {
        const double height = stage.random.uniform(0.3, 0.5);
        const Vec3 size(stage.random.uniform(0.35, 0.6), stage.random.uniform(0.35, 0.6), height);
        stage.mesh.add_box(base + up(z + 0.5 * height), size, stage.random.uniform(0.0, 1.5), Material::kWood);
        z += height;
    }
    stage.obstacles.push_back(Obstacle::disc(base.head<2>(), 0.38));
}

}  // namespace dlod::tools::sim
