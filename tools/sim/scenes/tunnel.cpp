// A bare tunnel: along it nothing tells how far one has come. Structure only beyond its ends.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/sim/scene_builder.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kHalfWidth = 3.0;
constexpr double kWallHeight = 2.6;
constexpr double kInside_m = 32.0;  ///< tunnel behind the robot's start

/// Walls and vault of a straight tunnel along x.
void add_tube(Mesh& mesh, double begin, double end) {
    std::vector<Vec2> section{{-kHalfWidth, 0.0}};
    constexpr int kSteps = 16;
    for (int i = 0; i <= kSteps; ++i) {
        const double a = std::numbers::pi * (1.0 - static_cast<double>(i) / kSteps);
        section.emplace_back(kHalfWidth * std::cos(a), kWallHeight + 1.8 * std::sin(a));
    }
    section.emplace_back(kHalfWidth, 0.0);
    for (std::size_t i = 0; i + 1 < section.size(); ++i) {
        const auto at = [&](double x, const Vec2& p) { return Vec3(x, p.x(), p.y()); };
        mesh.add_quad(at(begin, section[i]), at(end, section[i]), at(end, section[i + 1]), at(begin, section[i + 1]),
                      Material::kConcrete);
    }
}

/// What is before a portal; `out` is 1 at the far end.
void add_yard(SceneBuilder& b, double x, double out) {
    Random& random = b.random();
    const Rectangle area{{std::min(x, x + out * 30.0), -14.0}, {std::max(x, x + out * 30.0), 14.0}};
    for (const double side : {-1.0, 1.0}) {
        // The portal's wall, seen from the yard.
        const double middle = side * (kHalfWidth + 6.0);
        b.mesh().add_box(Vec3(x, middle, 3.5), Vec3(0.5, 12.0, 7.0), 0.0, Material::kConcrete);
    }
    b.mesh().add_box(Vec3(x, 0.0, 5.8), Vec3(0.5, 2.0 * kHalfWidth, 2.4), 0.0, Material::kConcrete);
    const Vec2 a(x + out * 34.0, out * 15.0);
    const Vec2 c(x + out * 34.0, -out * 15.0);
    add_house(b.mesh(), random, a, c, -0.2, 9.0, random_style(random));
    const auto place = [&](double clear) { return b.on_ground(b.free_place(area, clear, clear + 1.5)); };
    for (int i = 0; i < 5; ++i) add_tree(b.stage(), place(1.0));
    for (int i = 0; i < 4; ++i) add_bush(b.stage(), place(1.0), random.uniform(0.4, 0.9));
    for (int i = 0; i < 3; ++i) add_lamp_post(b.stage(), place(0.6));
}

}  // namespace

World build_tunnel(const SceneOptions& options) {
    SceneBuilder b(options, 5);
    Random& random = b.random();
    const double way = options.robot.speed_mps * options.duration_s;
    const double begin = -kInside_m;
    const double end = way + 45.0;
    b.set_path(ArcPath({Vec2(0.0, -1.0), Vec2(0.5 * way + 10.0, -0.9), Vec2(way + 40.0, -1.0)}, false, 10.0));
    b.add_ground({{begin - 45.0, -30.0}, {end + 45.0, 30.0}}, 10.0, Material::kAsphalt);
    add_tube(b.mesh(), begin, end);
    for (const double side : {-1.0, 1.0}) {
        b.obstacles().push_back(Obstacle::wall(Vec2(begin, side * kHalfWidth), Vec2(end, side * kHalfWidth), 0.4));
    }
    add_yard(b, begin, -1.0);
    add_yard(b, end, 1.0);
    for (int i = 0; i < 4; ++i) {
        Walker w;
        w.start = Vec2(random.uniform(5.0, 12.0 + way), random.uniform(-2.2, -0.2));
        w.route = {w.start + Vec2(random.sign() * 25.0, 0.0), w.start};
        w.speed_mps = random.uniform(0.9, 1.5);
        b.add_walker(SceneBuilder::Kind::kPerson, w);
    }
    const ArcPath lane({Vec2(end + 80.0, 1.5), Vec2(begin - 120.0, 1.5)}, false, 20.0);
    b.add_lane(lane, {{"van", {.s_m = 80.0 + 0.5 * (end - begin) - 15.0, .length_m = 5.6, .speed_mps = 6.0}}}, {});
    return b.finish();
}

}  // namespace dlod::tools::sim
