// A yard where people and a dog go round the robot again and again, and two walk beside it when it moves.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/sim/scene_builder.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Round a middle, again and again; `sense` 1 is counter-clockwise.
Walker orbit(const Vec2& middle, double radius, double sense, double first, double speed) {
    Walker w;
    constexpr int kPoints = 14;
    for (int i = 0; i < kPoints; ++i) {
        const double angle = first + sense * kTurn * i / kPoints;
        w.route.emplace_back(middle + radius * Vec2(std::cos(angle), std::sin(angle)));
    }
    w.start = w.route.back();
    w.reached_m = std::min(0.7, 0.8 * kTurn * radius / kPoints);
    w.speed_mps = speed;
    return w;
}

void add_people(SceneBuilder& b, const Vec2& middle) {
    using Kind = SceneBuilder::Kind;
    Random& random = b.random();
    const bool moves = b.options().robot.speed_mps > 0.0;
    for (int i = 0; i < 6; ++i) {
        const double radius = 1.9 + 1.0 * i + random.uniform(-0.2, 0.2);
        b.add_walker(Kind::kPerson, orbit(middle, radius, i % 2 == 0 ? 1.0 : -1.0, random.uniform(0.0, kTurn),
                                          random.uniform(0.8, 1.5)));
    }
    // A dog on an eight, through the same place each time.
    Walker dog;
    for (int i = 0; i < 16; ++i) {
        const double a = kTurn * i / 16.0;
        dog.route.emplace_back(middle + Vec2(6.0, 2.5) + Vec2(3.2 * std::sin(a), 1.8 * std::sin(2.0 * a)));
    }
    dog.start = dog.route.back();
    dog.reached_m = 0.5;
    dog.speed_mps = random.uniform(2.0, 3.0);
    b.add_walker(Kind::kDog, dog);
    if (moves) {
        for (const double side : {-1.0, 1.0}) {
            Walker w;
            w.leader = Walker::kRobot;
            w.offset = Vec2(random.uniform(-0.2, 0.5), side * random.uniform(1.0, 1.4));
            b.add_walker(Kind::kPerson, w);
        }
    }
    // Bystanders, one of whom leaves.
    for (int i = 0; i < 3; ++i) {
        Walker w;
        w.start = b.free_place({{-9.0, -9.0}, {9.0, 9.0}}, 0.8, 2.0);
        w.route = {w.start, b.free_place({{-9.0, -9.0}, {9.0, 9.0}}, 0.8, 2.0)};
        w.pause_s = {i == 0 ? 8.0 : 1e9, 2.0};
        w.reached_m = 0.4;
        b.add_walker(Kind::kPerson, w);
    }
    b.add_walker(Kind::kCyclist, orbit(middle, 9.0, 1.0, random.uniform(0.0, kTurn), 3.5));
}

}  // namespace

World build_circle(const SceneOptions& options) {
    SceneBuilder b(options, 4);
    Random& random = b.random();
    b.set_terrain([](double x, double y) { return 0.02 * std::sin(0.2 * x) + 0.006 * y; });
    std::vector<Vec2> corners;
    for (int i = 0; i < 8; ++i) {
        const double angle = kTurn * i / 8.0;
        corners.emplace_back(random.uniform(5.0, 7.5) * Vec2(std::cos(angle), std::sin(angle)));
    }
    const ArcPath path(corners, true, 2.5);
    b.set_path(path);
    b.add_ground({{-40.0, -40.0}, {40.0, 40.0}}, 2.0, Material::kPaving);
    const Vec2 c[4] = {{-16.0, -13.0}, {16.0, -13.0}, {16.0, 13.0}, {-16.0, 13.0}};
    for (int i = 0; i < 4; ++i) {  // walls that face inwards: clockwise
        const Vec2& from = c[(4 - i) % 4];
        const Vec2& to = c[(3 - i) % 4];
        const Vec2 d = (to - from).normalized();
        const double gap = random.uniform(0.35, 0.65) * (to - from).norm();
        add_house(b.mesh(), random, from, from + d * (gap - 2.0), -0.3, 9.0, random_style(random));
        add_house(b.mesh(), random, from + d * (gap + 2.0), to, -0.3, 9.0, random_style(random));
        b.obstacles().push_back(Obstacle::wall(from, to, 0.6));
    }
    const Rectangle area{{-14.5, -11.5}, {14.5, 11.5}};
    const auto place = [&](double clear) { return b.on_ground(b.free_place(area, clear, clear + 0.8)); };
    const auto yaw = [&] { return random.uniform(0.0, kTurn); };
    for (int i = 0; i < 4; ++i) add_tree(b.stage(), place(0.8));
    for (int i = 0; i < 4; ++i) add_bench(b.stage(), place(1.1), yaw());
    for (int i = 0; i < 4; ++i) add_lamp_post(b.stage(), place(0.6));
    for (int i = 0; i < 3; ++i) add_bush(b.stage(), place(0.9), random.uniform(0.4, 0.7));
    for (int i = 0; i < 3; ++i) add_bin(b.stage(), place(0.6));
    add_statue(b.stage(), place(1.2));
    add_cafe_table(b.stage(), place(1.3), true);
    add_people(b, path.point(0.0));
    return b.finish();
}

}  // namespace dlod::tools::sim
