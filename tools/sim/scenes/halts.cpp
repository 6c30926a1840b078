// A small square beside a road with a light: vehicles and people who stop for some seconds and go on, again and again.
#include <cmath>
#include <numbers>

#include "tools/sim/scene_builder.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kRoadNorth = -7.5;
constexpr double kRoadSouth = -14.5;
constexpr double kHalfWidth = 60.0;
constexpr double kClosed_s = 7.0;  ///< of the light, longer than the 3 s after which what rests is static
constexpr double kCycle_s = 15.0;

double ground_height(double x, double y) {
    const bool road = y < kRoadNorth && y > kRoadSouth;
    return 0.02 * std::sin(0.15 * x) - (road ? 0.12 : 0.0);
}

void add_people(SceneBuilder& b, const Rectangle& area) {
    Random& random = b.random();
    for (int i = 0; i < 10; ++i) {
        Walker w;
        for (int k = 0; k < 6; ++k) {
            w.route.push_back(b.free_place(area, 0.6, 1.0));
            w.pause_s.push_back(random.uniform(3.5, 6.0));
        }
        w.start = w.route.back();
        w.speed_mps = random.uniform(0.8, 1.6);
        w.reached_m = 0.4;
        b.add_walker(i == 0 ? SceneBuilder::Kind::kDog : SceneBuilder::Kind::kPerson, w);
    }
}

void add_traffic(SceneBuilder& b) {
    Random& random = b.random();
    const double seconds = b.options().duration_s;
    const double closes = random.uniform(1.0, 4.0);
    StopLine light;
    for (double t = closes - kCycle_s; t < seconds + 1.0; t += kCycle_s) light.closed_s.emplace_back(t, t + kClosed_s);
    const auto add_lane = [&](double y, double direction) {
        const double half = 150.0 + 8.0 * seconds;  // from where the last of them come
        const ArcPath lane({Vec2(-direction * half, y), Vec2(direction * half, y)}, false, 20.0);
        light.s_m = half - 2.0;
        std::vector<std::pair<std::string, Driver>> vehicles;
        double s = light.s_m - 8.0;
        for (int i = 0; s > 20.0; ++i) {
            const bool bus = i % 7 == 3;
            vehicles.emplace_back(
                bus                  ? "bus"
                : random.chance(0.2) ? "van"
                                     : "car",
                Driver{.s_m = s, .length_m = bus ? 12.0 : 4.8, .speed_mps = random.uniform(6.0, 10.0)});
            s -= random.uniform(14.0, 24.0);
        }
        b.add_lane(lane, vehicles, {light});
    };
    add_lane(-9.3, -1.0);
    add_lane(-12.7, 1.0);
}

}  // namespace

World build_halts(const SceneOptions& options) {
    SceneBuilder b(options, 7);
    Random& random = b.random();
    b.set_terrain(ground_height);
    std::vector<Vec2> corners;
    for (int i = 0; i < 8; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / 8.0;
        const double radius = random.uniform(3.0, 5.0);
        corners.emplace_back(1.6 * radius * std::cos(angle), radius * std::sin(angle));
    }
    b.set_path(ArcPath(corners, true, 2.0));
    b.add_ground({{-kHalfWidth, kRoadNorth}, {kHalfWidth, 30.0}}, 1.0, Material::kPaving);
    b.add_ground({{-kHalfWidth, kRoadSouth}, {kHalfWidth, kRoadNorth}}, 1.0, Material::kAsphalt);
    b.add_ground({{-kHalfWidth, -30.0}, {kHalfWidth, kRoadSouth}}, 1.0, Material::kPaving);
    b.add_kerb(Vec2(-kHalfWidth, kRoadNorth), Vec2(kHalfWidth, kRoadNorth));
    b.add_kerb(Vec2(-kHalfWidth, kRoadSouth), Vec2(kHalfWidth, kRoadSouth));
    for (const double side : {1.0, -1.0}) {  // the outside of a wall is to the right of its direction
        for (double x = -45.0; x < 40.0;) {
            const double width = random.uniform(9.0, 15.0);
            const double y = side > 0.0 ? 14.0 : -18.5;
            const Vec2 from(side > 0.0 ? x : x + width, y), to(side > 0.0 ? x + width : x, y);
            add_house(b.mesh(), random, from, to, -0.3, 10.0, random_style(random));
            b.obstacles().push_back(Obstacle::wall(from, to, 0.6));
            x += width + (random.chance(0.4) ? 4.0 : 0.0);
        }
    }
    const Rectangle area{{-15.0, kRoadNorth + 1.0}, {15.0, 12.5}};
    const auto place = [&](double clear) { return b.on_ground(b.free_place(area, clear, clear + 0.8)); };
    const auto yaw = [&] { return random.uniform(0.0, 2.0 * std::numbers::pi); };
    for (int i = 0; i < 4; ++i) add_tree(b.stage(), place(0.9));
    for (int i = 0; i < 4; ++i) add_bench(b.stage(), place(1.1), yaw());
    for (int i = 0; i < 3; ++i) add_lamp_post(b.stage(), place(0.7));
    for (int i = 0; i < 3; ++i) add_bin(b.stage(), place(0.7));
    for (int i = 0; i < 2; ++i) add_planter(b.stage(), place(1.2), yaw());
    for (double x = -30.0; x < 30.0; x += random.uniform(6.0, 12.0)) {
        add_parked_car(b.stage(), b.on_ground(Vec2(x, kRoadSouth - 1.3)), 0.0);
    }
    add_traffic_light(b.stage(), b.on_ground(Vec2(3.0, kRoadNorth + 0.4)), 0.0);
    add_people(b, area);
    add_traffic(b);
    return b.finish();
}

}  // namespace dlod::tools::sim
