// A town square: houses around it, trees, benches, posts, a cafe, people who cross and stand, cyclists, a road beside.
#include <cmath>
#include <numbers>

#include "tools/sim/scene_builder.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kRoadNorth = -19.0;
constexpr double kRoadSouth = -26.0;
constexpr double kHalfWidth = 60.0;

double square_height(double x, double y) {
    const double slope = 0.035 * std::sin(0.13 * x) * std::cos(0.11 * y) + 0.004 * x;
    const bool road = y < kRoadNorth && y > kRoadSouth;
    return slope - (road ? 0.12 : 0.0);
}

/// A loop around the middle, different for each seed.
ArcPath robot_loop(Random& random) {
    std::vector<Vec2> corners;
    const int n = 9;
    const double first = random.uniform(0.0, 2.0 * std::numbers::pi);
    for (int i = 0; i < n; ++i) {
        const double angle = first + 2.0 * std::numbers::pi * i / n;
        const double radius = random.uniform(6.0, 11.5);
        corners.emplace_back(1.35 * radius * std::cos(angle), radius * std::sin(angle));
    }
    return {corners, true, 3.0};
}

/// Houses side by side along a line, with alleys between some.
void add_row(SceneBuilder& b, const Vec2& from, const Vec2& to, bool alleys) {
    Random& random = b.random();
    const Vec2 d = (to - from).normalized();
    const Vec2 back(-d.y(), d.x());
    const double length = (to - from).norm();
    double u = 0.0;
    while (u < length - 4.0) {
        double width = random.uniform(9.0, 17.0);
        if (length - u - width < 6.0) width = length - u;
        const Vec2 offset = back * random.uniform(0.0, 1.2);
        const Vec2 a = from + d * u + offset;
        const Vec2 c = from + d * (u + width) + offset;
        add_house(b.mesh(), random, a, c, -0.3, 10.0, random_style(random));
        b.obstacles().push_back(Obstacle::wall(a + back * 5.0, c + back * 5.0, 10.0));
        u += width + (alleys && random.chance(0.6) ? random.uniform(2.5, 4.5) : 0.0);
    }
}

void add_furniture(SceneBuilder& b, const Rectangle& area) {
    Random& random = b.random();
    const auto place = [&](double clear) { return b.on_ground(b.free_place(area, clear, clear + 1.0)); };
    const auto yaw = [&] { return random.uniform(0.0, 2.0 * std::numbers::pi); };
    add_fountain(b.stage(), place(3.2));
    if (random.chance(0.7)) add_kiosk(b.stage(), place(2.4), yaw());
    add_statue(b.stage(), place(1.5));
    for (int i = random.integer(6, 9); i > 0; --i) add_tree(b.stage(), place(1.0));
    for (int i = random.integer(6, 9); i > 0; --i) add_bench(b.stage(), place(1.2), yaw());
    for (int i = random.integer(5, 7); i > 0; --i) add_lamp_post(b.stage(), place(0.8));
    for (int i = random.integer(3, 5); i > 0; --i) add_bin(b.stage(), place(0.8));
    for (int i = random.integer(3, 5); i > 0; --i) add_planter(b.stage(), place(1.2), yaw());
    for (int i = random.integer(3, 6); i > 0; --i) add_bush(b.stage(), place(1.2), random.uniform(0.4, 0.8));
    for (int i = random.integer(3, 6); i > 0; --i) add_cafe_table(b.stage(), place(1.5), random.chance(0.6));
    for (int i = random.integer(2, 4); i > 0; --i) add_sign(b.stage(), place(0.8), yaw());
    const Vec2 rack = b.free_place(area, 2.5, 2.5);
    const double rack_yaw = yaw();
    for (int i = 0; i < 5; ++i) {
        const Vec2 p = rack + Eigen::Rotation2Dd(rack_yaw) * Vec2(0.0, 0.65 * (i - 2));
        if (random.chance(0.7)) add_parked_bicycle(b.stage(), b.on_ground(p), rack_yaw);
    }
    for (double x = -24.0; x <= 24.0; x += 2.4) {
        add_bollard(b.stage(), b.on_ground(Vec2(x, kRoadNorth + 0.5)));
    }
}

void add_people(SceneBuilder& b, const Rectangle& area) {
    using Kind = SceneBuilder::Kind;
    Random& random = b.random();
    for (int i = random.integer(4, 6); i > 0; --i) b.add_wanderer(Kind::kPerson, area, random.uniform(0.9, 1.7), 0.3);
    b.add_passers(random.integer(5, 8), 1.5, 7.0);
    for (int i = random.integer(2, 3); i > 0; --i) {  // pairs side by side
        const int leader = b.add_wanderer(Kind::kPerson, area, random.uniform(0.9, 1.4), 0.15);
        Walker w;
        w.leader = leader;
        w.offset = Vec2(random.uniform(-0.2, 0.1), random.sign() * random.uniform(0.6, 0.8));
        b.add_walker(Kind::kPerson, w);
    }
    for (int i = 0; i < 2; ++i) b.add_wanderer(Kind::kPerson, area, random.uniform(2.6, 3.6), 0.0);  // runners
    // A group that talks; one of them leaves.
    const Vec2 group = b.free_place(area, 1.6, 2.0);
    for (int i = 0; i < 3; ++i) {
        const double angle = 2.1 * i;
        Walker w;
        w.start = group + 0.75 * Vec2(std::cos(angle), std::sin(angle));
        w.route = {w.start, b.free_place(area, 0.6, 0.0)};
        w.pause_s = {i == 0 ? random.uniform(6.0, 9.0) : 1e9, 3.0};
        w.reached_m = 0.4;
        b.add_walker(Kind::kPerson, w);
    }
    // Somebody who walks close along the houses.
    Walker wall;
    wall.start = Vec2(-18.0, area.high.y() - 0.6);
    wall.route = {Vec2(18.0, area.high.y() - 0.6), wall.start};
    wall.speed_mps = 1.2;
    b.add_walker(Kind::kPerson, wall);
    b.add_wanderer(Kind::kDog, area, random.uniform(1.5, 2.8), 0.2);
    for (int i = random.integer(1, 2); i > 0; --i) {
        b.add_wanderer(Kind::kCyclist, area, random.uniform(2.6, 4.0), 0.0);
    }
}

void add_traffic(SceneBuilder& b) {
    Random& random = b.random();
    const auto driver = [&](double s, double length, double speed) {
        return Driver{.s_m = s, .length_m = length, .speed_mps = speed};
    };
    const ArcPath east({Vec2(-90.0, -24.2), Vec2(90.0, -24.2)}, false, 10.0);
    const ArcPath west({Vec2(90.0, -20.8), Vec2(-90.0, -20.8)}, false, 10.0);
    const double first = random.uniform(70.0, 100.0);
    b.add_lane(east,
               {{"car", driver(first, 4.4, random.uniform(4.0, 8.0))},
                {"van", driver(first - 22.0, 5.6, random.uniform(5.0, 9.0))},
                {"cyclist", driver(first - 40.0, 1.8, 4.5)}},
               {});
    const double second = random.uniform(60.0, 90.0);
    b.add_lane(west,
               {{"bus", driver(second, 12.0, random.uniform(4.0, 7.0))},
                {"car", driver(second - 25.0, 4.4, random.uniform(5.0, 9.0))}},
               {{.s_m = 95.0, .closed_s = {{2.0, 6.0}}}});
}

}  // namespace

World build_square(const SceneOptions& options) {
    SceneBuilder b(options, 1);
    b.set_terrain(square_height);
    b.set_path(robot_loop(b.random()));
    b.add_ground({{-kHalfWidth, kRoadNorth}, {kHalfWidth, 45.0}}, 1.0, Material::kPaving);
    b.add_ground({{-kHalfWidth, kRoadSouth}, {kHalfWidth, kRoadNorth}}, 1.0, Material::kAsphalt);
    b.add_ground({{-kHalfWidth, -45.0}, {kHalfWidth, kRoadSouth}}, 1.0, Material::kPaving);
    b.add_kerb(Vec2(-kHalfWidth, kRoadNorth), Vec2(kHalfWidth, kRoadNorth));
    b.add_kerb(Vec2(-kHalfWidth, kRoadSouth), Vec2(kHalfWidth, kRoadSouth));
    // The outside of a wall is to the right of its direction: each row runs so that the square is there.
    add_row(b, Vec2(-26.0, 20.0), Vec2(26.0, 20.0), true);
    add_row(b, Vec2(26.0, 19.0), Vec2(26.0, -18.0), true);
    add_row(b, Vec2(-26.0, -18.0), Vec2(-26.0, 19.0), true);
    add_row(b, Vec2(50.0, -29.5), Vec2(-50.0, -29.5), true);
    const Rectangle area{{-24.0, -17.5}, {24.0, 18.5}};
    add_furniture(b, area);
    for (double x = -45.0; x < 45.0; x += b.random().uniform(5.6, 11.0)) {  // parked along the far kerb
        add_parked_car(b.stage(), b.on_ground(Vec2(x, kRoadSouth - 1.3)), b.random().chance(0.5) ? 0.0 : 3.14159);
    }
    add_people(b, area);
    add_traffic(b);
    return b.finish();
}

}  // namespace dlod::tools::sim
