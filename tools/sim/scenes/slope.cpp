// A hillside: a paved ramp, stairs beside it, a grassy bank, walls and hedges, people on all of them.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/sim/scene_builder.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kRampBegin = 7.0;
constexpr double kRampEnd = 21.0;
constexpr double kRise = 1.968;  ///< 8 degrees
constexpr double kStairsLow = 3.0;
constexpr double kStairsHigh = 6.0;
constexpr double kStairsBegin = 11.0;
constexpr int kSteps = 12;
constexpr double kTread = 0.34;

double hill_height(double x, double y) {
    const double across = 0.035 * y;
    if (y < kStairsLow) {
        return across + kRise * std::clamp((x - kRampBegin) / (kRampEnd - kRampBegin), 0.0, 1.0);
    }
    if (y < kStairsHigh) {
        const double step = std::clamp(std::ceil((x - kStairsBegin) / kTread), 0.0, static_cast<double>(kSteps));
        return across + kRise * step / kSteps;
    }
    const double u = std::clamp((x - 4.0) / 22.0, 0.0, 1.0);
    return across + 2.6 * u * u * (3.0 - 2.0 * u) + 0.12 * std::sin(0.7 * x) * std::sin(0.5 * y);
}

void add_terrain(SceneBuilder& b) {
    b.add_ground({{-40.0, -12.0}, {60.0, kStairsLow}}, 1.0, Material::kPaving);
    b.add_ground({{-40.0, kStairsHigh}, {60.0, 24.0}}, 1.0, Material::kGrass);
    const double end = kStairsBegin + kSteps * kTread;
    b.add_ground({{-40.0, kStairsLow}, {kStairsBegin, kStairsHigh}}, 2.0, Material::kPaving);
    b.add_ground({{end, kStairsLow}, {60.0, kStairsHigh}}, 2.0, Material::kPaving);
    for (int i = 0; i < kSteps; ++i) {
        const double x = kStairsBegin + i * kTread;
        b.add_ground({{x, kStairsLow}, {x + kTread, kStairsHigh}}, 3.0, Material::kPaving);
        b.add_kerb(Vec2(x, kStairsLow), Vec2(x, kStairsHigh));
    }
    // Low walls where the levels differ, with a rail.
    for (const double y : {kStairsLow, kStairsHigh}) {
        for (double x = 6.0; x < 22.0; x += 2.0) {
            const double low = std::min(hill_height(x, y - 0.05), hill_height(x, y + 0.05)) - 0.3;
            const double high = std::max(hill_height(x + 2.0, y - 0.05), hill_height(x + 2.0, y + 0.05)) + 0.25;
            b.mesh().add_box(Vec3(x + 1.0, y, 0.5 * (low + high)), Vec3(2.0, 0.25, high - low), 0.0,
                             Material::kConcrete);
            const Vec3 post(x, y, high);
            b.mesh().add_bar(post, post + Vec3(0.0, 0.0, 0.9), 0.025, Material::kMetal);
            b.mesh().add_bar(post + Vec3(0.0, 0.0, 0.9), post + Vec3(2.0, 0.0, 0.9), 0.025, Material::kMetal);
        }
        b.obstacles().push_back(Obstacle::wall(Vec2(6.0, y), Vec2(22.0, y), 0.25));
    }
}

void add_people(SceneBuilder& b) {
    using Kind = SceneBuilder::Kind;
    Random& random = b.random();
    for (int i = 0; i < 4; ++i) {  // up and down the stairs
        Walker w;
        const double y = random.uniform(kStairsLow + 0.5, kStairsHigh - 0.5);
        w.start = Vec2(random.uniform(4.0, 22.0), y);
        w.route = {Vec2(24.0, y), Vec2(3.0, y)};
        if (i % 2 == 0) std::swap(w.route[0], w.route[1]);
        w.speed_mps = random.uniform(0.6, 1.1);
        b.add_walker(Kind::kPerson, w);
    }
    for (int i = 0; i < 5; ++i) {
        b.add_wanderer(Kind::kPerson, {{-6.0, -7.5}, {30.0, 2.2}}, random.uniform(0.8, 1.5), 0.25);
    }
    b.add_passers(3, 1.5, 3.0);
    b.add_wanderer(Kind::kPerson, {{0.0, 7.0}, {30.0, 14.0}}, 1.2, 0.2);
    b.add_wanderer(Kind::kDog, {{0.0, 7.0}, {30.0, 14.0}}, 2.4, 0.1);
    b.add_wanderer(Kind::kCyclist, {{-10.0, -7.0}, {34.0, 1.5}}, 3.2, 0.0);
}

}  // namespace

World build_slope(const SceneOptions& options) {
    SceneBuilder b(options, 6);
    Random& random = b.random();
    b.set_terrain(hill_height);
    const double first = random.uniform(-1.0, 9.0);
    b.set_path(ArcPath({Vec2(first, -5.0), Vec2(25.0, -5.2), Vec2(29.0, -2.0), Vec2(25.0, 1.0), Vec2(-2.0, 0.8),
                        Vec2(-6.0, -2.0), Vec2(-2.0, -5.0)},
                       true, 2.2));
    add_terrain(b);
    for (double x = -36.0; x < 50.0;) {
        const double width = random.uniform(9.0, 15.0);
        const Vec2 a(x + width, -9.5);
        add_house(b.mesh(), random, a, Vec2(x, -9.5), hill_height(x, -9.5) - 0.8, 9.0, random_style(random));
        b.obstacles().push_back(Obstacle::wall(Vec2(x, -14.0), Vec2(x + width, -14.0), 9.0));
        x += width + (random.chance(0.4) ? 2.5 : 0.0);
    }
    add_house(b.mesh(), random, Vec2(-5.0, 21.0), Vec2(16.0, 21.0), 0.0, 9.0, random_style(random));
    add_house(b.mesh(), random, Vec2(46.0, 18.0), Vec2(46.0, -6.0), 1.0, 9.0, random_style(random));
    add_house(b.mesh(), random, Vec2(-28.0, -8.0), Vec2(-28.0, 16.0), -0.5, 9.0, random_style(random));
    const Rectangle hill{{-15.0, 7.0}, {38.0, 18.0}};
    const Rectangle terrace{{-14.0, -8.5}, {38.0, 2.0}};
    const auto place = [&](const Rectangle& area, double clear) {
        return b.on_ground(b.free_place(area, clear, clear + 0.8));
    };
    for (int i = 0; i < 9; ++i) add_tree(b.stage(), place(hill, 1.0));
    for (int i = 0; i < 8; ++i) add_bush(b.stage(), place(hill, 1.0), random.uniform(0.4, 1.0));
    for (int i = 0; i < 4; ++i) add_bench(b.stage(), place(terrace, 1.1), random.uniform(0.0, 6.28));
    for (int i = 0; i < 5; ++i) add_lamp_post(b.stage(), place(terrace, 0.6));
    for (int i = 0; i < 4; ++i) add_bollard(b.stage(), place(terrace, 0.6));
    for (int i = 0; i < 3; ++i) add_planter(b.stage(), place(terrace, 1.0), random.uniform(0.0, 6.28));
    add_hedge(b.stage(), b.on_ground(Vec2(24.0, 6.8)), b.on_ground(Vec2(36.0, 7.2)), 1.2);
    add_people(b);
    return b.finish();
}

}  // namespace dlod::tools::sim
