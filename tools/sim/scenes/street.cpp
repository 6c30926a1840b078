// A street: lanes with a light, parked cars, side streets, pavements with people, cyclists.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/sim/scene_builder.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kRoad = 5.5;      ///< half width with the parking strips
constexpr double kPavement = 9.5;  ///< half width with the pavements
constexpr double kLane = 1.65;
constexpr double kBehind_m = 70.0;  ///< street behind the robot's start
constexpr double kAhead_m = 90.0;   ///< and beyond its end
constexpr double kCrossing_x = 24.0;

double street_height(double x, double y) {
    const double camber = -0.015 * std::min(std::abs(y), kRoad);
    return 0.012 * x + 0.05 * std::sin(0.05 * x) + camber + (std::abs(y) > kRoad ? 0.13 : 0.0);
}

void add_houses(SceneBuilder& b, double begin, double end, double side) {
    Random& random = b.random();
    double x = begin;
    int since_gap = 0;
    while (x < end) {
        const double width = random.uniform(9.0, 16.0);
        const double y = side * (kPavement + random.uniform(0.0, 0.8));
        // The outside of a wall is to the right of its direction.
        const Vec2 a(side > 0.0 ? x : x + width, y);
        const Vec2 c(side > 0.0 ? x + width : x, y);
        add_house(b.mesh(), random, a, c, street_height(x, 0.0) - 0.6, 12.0, random_style(random));
        b.obstacles().push_back(Obstacle::wall(Vec2(x, y + side * 6.0), Vec2(x + width, y + side * 6.0), 12.0));
        x += width;
        if (++since_gap >= 3 && random.chance(0.6)) {  // a side street
            x += 8.0;
            since_gap = 0;
        } else if (random.chance(0.2)) {
            x += random.uniform(1.5, 3.0);
        }
    }
}

void add_furniture(SceneBuilder& b, double begin, double end, bool robot_on_road) {
    Random& random = b.random();
    for (double x = begin; x < end; x += random.uniform(5.5, 9.5)) {
        if (std::abs(x - kCrossing_x) < 6.0) continue;
        add_parked_car(b.stage(), b.on_ground(Vec2(x, kRoad - 1.1)), random.chance(0.9) ? std::numbers::pi : 0.0);
        if (!robot_on_road && random.chance(0.7)) {
            add_parked_car(b.stage(), b.on_ground(Vec2(x + 1.0, -kRoad + 1.1)), 0.0);
        }
    }
    for (double x = begin; x < end; x += random.uniform(7.0, 12.0)) {
        for (const double side : {-1.0, 1.0}) {
            const Vec3 kerb = b.on_ground(Vec2(x + random.uniform(-2.0, 2.0), side * (kRoad + 0.55)));
            if (!b.is_free(kerb.head<2>(), 0.4, 0.9)) continue;
            switch (random.integer(0, 5)) {
                case 0:
                case 1:
                    add_tree(b.stage(), kerb);
                    break;
                case 2:
                    add_lamp_post(b.stage(), kerb);
                    break;
                case 3:
                    add_bin(b.stage(), kerb);
                    break;
                case 4:
                    add_sign(b.stage(), kerb, side > 0.0 ? 0.0 : std::numbers::pi);
                    break;
                default:
                    for (int i = 0; i < 3; ++i) add_bollard(b.stage(), kerb + Vec3(1.2 * i, 0.0, 0.0));
            }
            const Vec3 wall = b.on_ground(Vec2(x + 3.0, side * (kPavement - 0.45)));
            if (random.chance(0.3) && b.is_free(wall.head<2>(), 0.5, 1.0)) {
                add_parked_bicycle(b.stage(), wall, random.uniform(-0.1, 0.1));
            }
        }
    }
    add_traffic_light(b.stage(), b.on_ground(Vec2(kCrossing_x - 3.0, -kRoad - 0.4)), std::numbers::pi);
    add_traffic_light(b.stage(), b.on_ground(Vec2(kCrossing_x + 3.0, kRoad + 0.4)), 0.0);
    for (double y = -kRoad + 0.3; y < kRoad - 0.5; y += 1.0) {
        const Vec3 p = b.on_ground(Vec2(kCrossing_x, y + 0.25));
        b.mesh().add_box(p + Vec3(0.0, 0.0, 0.002), Vec3(3.0, 0.5, 0.006), 0.0, Material::kRoadMarking);
    }
}

void add_traffic(SceneBuilder& b, double begin, double end) {
    Random& random = b.random();
    const auto driver = [](double s, double length, double speed) {
        return Driver{.s_m = s, .length_m = length, .speed_mps = speed};
    };
    // Closed from a few seconds on, again and again.
    StopLine light;
    const double closes = random.uniform(0.5, 2.5);
    for (double t = closes; t < b.options().duration_s + 1.0; t += 18.0) light.closed_s.emplace_back(t, t + 8.0);
    const ArcPath east({Vec2(begin - 80.0, -kLane), Vec2(end + 80.0, -kLane)}, false, 20.0);
    const ArcPath west({Vec2(end + 80.0, kLane), Vec2(begin - 80.0, kLane)}, false, 20.0);
    light.s_m = kCrossing_x - 3.0 - (begin - 80.0);
    std::vector<std::pair<std::string, Driver>> lane;
    double s = light.s_m + 25.0;
    const int cars = 5 + static_cast<int>(b.options().duration_s / 6.0);
    for (int i = 0; i < cars; ++i) {
        const bool bus = i == 2 || b.options().buses;
        const char* kind = bus ? "bus" : random.chance(0.2) ? "van" : "car";
        lane.emplace_back(kind, driver(s, bus ? 12.0 : 4.6, random.uniform(7.0, 13.0)));
        s -= random.uniform(14.0, 26.0);
    }
    b.add_lane(east, lane, {light});
    light.s_m = end + 80.0 - (kCrossing_x + 3.0);
    lane.clear();
    s = light.s_m + 15.0;
    for (int i = 0; i < cars; ++i) {
        lane.emplace_back(random.chance(0.2) ? "van" : "car", driver(s, 4.8, random.uniform(6.0, 12.0)));
        s -= random.uniform(12.0, 30.0);
    }
    b.add_lane(west, lane, {light});
    const ArcPath bicycles({Vec2(end + 80.0, 3.05), Vec2(begin - 80.0, 3.05)}, false, 20.0);
    b.add_lane(bicycles,
               {{"cyclist", driver(end + 80.0 - 30.0, 1.8, 4.5)}, {"cyclist", driver(end + 80.0 - 42.0, 1.8, 5.0)}},
               {light});
}

void add_people(SceneBuilder& b, double length_m, double robot_y) {
    using Kind = SceneBuilder::Kind;
    Random& random = b.random();
    const int count = std::min(24, 12 + static_cast<int>(length_m / 8.0));
    for (int i = 0; i < count; ++i) {
        const double side = random.sign();
        const double y = side * random.uniform(kRoad + 1.0, kPavement - 0.5);
        Walker w;
        w.start = Vec2(random.uniform(-20.0, length_m + 30.0), y);
        if ((w.start - Vec2(0.0, robot_y)).norm() < 1.5) w.start.x() += 3.0;
        w.route = {w.start + Vec2(random.sign() * random.uniform(15.0, 40.0), 0.0), w.start};
        w.route[0].y() = side * random.uniform(kRoad + 1.0, kPavement - 0.5);
        w.speed_mps = random.chance(0.12) ? 2.9 : random.uniform(0.8, 1.6);
        w.pause_s = {random.uniform(0.0, 3.0), 1.0};
        b.add_walker(Kind::kPerson, w);
    }
    for (int i = 0; i < 3; ++i) {  // who cross while the cars wait
        const double side = random.sign();
        Walker w;
        w.start = Vec2(kCrossing_x + random.uniform(-1.2, 1.2), side * (kRoad + 1.0));
        w.route = {w.start, Vec2(w.start.x(), -side * (kRoad + 1.2)), Vec2(w.start.x() + 20.0, -side * (kRoad + 2.0))};
        w.pause_s = {random.uniform(6.5, 7.5), 0.0, 1e9};  // the run-up of 4 s counts
        w.speed_mps = random.uniform(1.2, 1.7);
        b.add_walker(Kind::kPerson, w);
    }
}

}  // namespace

World build_street(const SceneOptions& options) {
    SceneBuilder b(options, 3);
    b.set_terrain(street_height);
    // Slow robots keep to the pavement, fast ones ride along the lane.
    const bool on_road = options.robot.speed_mps > 2.5;
    const double robot_y = on_road ? -4.2 : -7.4;
    const double length = options.robot.speed_mps * options.duration_s + 10.0;
    std::vector<Vec2> corners;
    for (double x = 0.0; x < length + 30.0; x += 12.0) {
        corners.emplace_back(x, robot_y + b.random().uniform(-0.35, 0.35));
    }
    b.set_path(ArcPath(corners, false, 6.0));
    const double begin = -kBehind_m;
    const double end = length + kAhead_m;
    b.add_ground({{begin, -kRoad}, {end, kRoad}}, 2.75, Material::kAsphalt);
    for (const double side : {-1.0, 1.0}) {
        const double near = side * kRoad;
        const double far = side * 60.0;
        b.add_ground({{begin, std::min(near, far)}, {end, std::max(near, far)}}, 4.0, Material::kPaving);
        b.add_kerb(Vec2(begin, near), Vec2(end, near));
        add_houses(b, begin, end, side);
    }
    add_furniture(b, begin + 5.0, end - 5.0, on_road);
    add_people(b, length, robot_y);
    add_traffic(b, begin, end);
    return b.finish();
}

}  // namespace dlod::tools::sim
