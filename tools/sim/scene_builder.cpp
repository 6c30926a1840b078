#include "tools/sim/scene_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/sim/actors/cyclist.hpp"
#include "tools/sim/actors/dog.hpp"
#include "tools/sim/actors/person.hpp"
#include "tools/sim/actors/vehicle.hpp"

namespace dlod::tools::sim {
namespace {

double bicycle_stride_m(double) {
    return Cyclist::stride_m();
}

}  // namespace

SceneBuilder::SceneBuilder(const SceneOptions& options, std::uint64_t stream)
    : options_(options), random_(options.seed, stream) {}

void SceneBuilder::add_ground(const Rectangle& area, double cell_m, Material material) {
    const Vec2 size = area.high - area.low;
    const int nx = std::max(1, static_cast<int>(std::ceil(size.x() / cell_m)));
    const int ny = std::max(1, static_cast<int>(std::ceil(size.y() / cell_m)));
    // Just inside of the area, so that a step in the terrain along its border belongs to one side only.
    const auto at = [&](int i, int j) {
        constexpr double kInside = 1e-4;
        const double fx = std::clamp(static_cast<double>(i) / nx, kInside, 1.0 - kInside);
        const double fy = std::clamp(static_cast<double>(j) / ny, kInside, 1.0 - kInside);
        Vec3 p = on_ground(area.low + size.cwiseProduct(Vec2(fx, fy)));
        p.head<2>() = area.low + size.cwiseProduct(Vec2(static_cast<double>(i) / nx, static_cast<double>(j) / ny));
        return p;
    };
    for (int i = 0; i < nx; ++i) {
        for (int j = 0; j < ny; ++j) {
            mesh().add_quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), material);
        }
    }
}

void SceneBuilder::add_kerb(const Vec2& a, const Vec2& b) {
    const Vec2 d = (b - a).normalized();
    const Vec2 side = Vec2(-d.y(), d.x()) * 0.02;
    const int n = std::max(1, static_cast<int>((b - a).norm()));
    for (int i = 0; i < n; ++i) {
        const Vec2 p = a + (b - a) * (static_cast<double>(i) / n);
        const Vec2 q = a + (b - a) * (static_cast<double>(i + 1) / n);
        const auto at = [&](const Vec2& r, double sign) { return Vec3(r.x(), r.y(), on_ground(r + sign * side).z()); };
        mesh().add_quad(at(p, 1.0), at(q, 1.0), at(q, -1.0), at(p, -1.0), Material::kKerb);
    }
}

bool SceneBuilder::is_free(const Vec2& p, double clear_m, double path_m) const {
    Vec2 away;
    for (const Obstacle& o : obstacles_) {
        if (o.distance_m(p, away) < clear_m) return false;
    }
    return path_.length_m() == 0.0 || path_.distance_m(p) >= path_m;
}

Vec2 SceneBuilder::free_place(const Rectangle& area, double clear_m, double path_m) {
    Vec2 p = Vec2::Zero();
    for (int i = 0; i < 300; ++i) {
        p = Vec2(random_.uniform(area.low.x(), area.high.x()), random_.uniform(area.low.y(), area.high.y()));
        if (is_free(p, clear_m, path_m)) break;
    }
    return p;
}

int SceneBuilder::add_shape(Mesh mesh) {
    world_.shapes.push_back(std::move(mesh));
    return static_cast<int>(world_.shapes.size()) - 1;
}

int SceneBuilder::add_walker(Kind kind, Walker walker) {
    switch (kind) {
        case Kind::kPerson:
            walker.stride_m = Person::stride_m;
            break;
        case Kind::kDog:
            walker.stride_m = Dog::stride_m;
            walker.radius_m = 0.35;
            break;
        case Kind::kCyclist:
            walker.stride_m = bicycle_stride_m;
            walker.radius_m = 0.6;
            walker.agility_mps2 = 2.5;
            walker.reached_m = 2.0;
            break;
    }
    walkers_.push_back(std::move(walker));
    kinds_.push_back(kind);
    return static_cast<int>(walkers_.size()) - 1;
}

int SceneBuilder::add_wanderer(Kind kind, const Rectangle& area, double speed_mps, double pause_share) {
    Walker w;
    w.speed_mps = speed_mps;
    w.start = free_place(area, 0.5, options_.robot.speed_mps > 0.0 ? 0.8 : 1.5);
    const int stops = random_.integer(3, 6);
    for (int i = 0; i < stops; ++i) {
        w.route.push_back(free_place(area, 0.6, 0.0));
        w.pause_s.push_back(random_.chance(pause_share) ? random_.uniform(2.0, 6.0) : 0.0);
    }
    return add_walker(kind, std::move(w));
}

void SceneBuilder::add_passers(int count, double near_m, double far_m) {
    const double reach = options_.robot.speed_mps * options_.duration_s + 4.0;
    const auto beside = [&] {
        Vec2 p = Vec2::Zero();
        for (int i = 0; i < 100; ++i) {
            const double s = random_.uniform(-4.0, path_.closed() ? std::min(reach, path_.length_m()) : reach);
            const double heading = path_.heading(s);
            p = path_.point(s) +
                random_.sign() * random_.uniform(near_m, far_m) * Vec2(-std::sin(heading), std::cos(heading));
            if (is_free(p, 0.5, 0.8)) break;
        }
        return p;
    };
    for (int i = 0; i < count; ++i) {
        Walker w;
        w.speed_mps = random_.uniform(0.8, 1.6);
        w.start = beside();
        for (int k = random_.integer(3, 5); k > 0; --k) {
            w.route.push_back(beside());
            w.pause_s.push_back(random_.chance(0.2) ? random_.uniform(1.5, 4.0) : 0.0);
        }
        add_walker(Kind::kPerson, std::move(w));
    }
}

void SceneBuilder::add_crowd(int count) {
    const Vec2 middle = path_.point(0.0);
    const auto around = [&] {
        Vec2 p = Vec2::Zero();
        for (int i = 0; i < 100; ++i) {
            const double angle = random_.uniform(0.0, 2.0 * std::numbers::pi);
            p = middle + random_.uniform(1.0, 5.0) * Vec2(std::cos(angle), std::sin(angle));
            if (is_free(p, 0.4, 0.0)) break;
        }
        return p;
    };
    for (int i = 0; i < count; ++i) {
        Walker w;
        w.speed_mps = random_.uniform(0.5, 1.2);
        w.start = around();
        for (int k = random_.integer(3, 5); k > 0; --k) {
            w.route.push_back(around());
            w.pause_s.push_back(random_.chance(0.3) ? random_.uniform(1.0, 4.0) : 0.0);
        }
        add_walker(Kind::kPerson, std::move(w));
    }
}

void SceneBuilder::add_lane(const ArcPath& lane, const std::vector<std::pair<std::string, Driver>>& vehicles,
                            const std::vector<StopLine>& stops) {
    if (!options_.movers) return;
    std::vector<Driver> drivers;
    for (const auto& v : vehicles) drivers.push_back(v.second);
    std::vector<Motion> motions = drive_lane(lane, drivers, stops, options_.duration_s);
    for (std::size_t i = 0; i < vehicles.size(); ++i) {
        const std::string& kind = vehicles[i].first;
        if (kind == "cyclist") {
            if (bicycle_frame_ < 0) {
                bicycle_frame_ = add_shape(bicycle_frame_mesh());
                bicycle_wheel_ = add_shape(bicycle_wheel_mesh());
            }
            add_actor(
                std::make_unique<Cyclist>(std::move(motions[i]), terrain_, bicycle_frame_, bicycle_wheel_, random_));
            continue;
        }
        const int shape = add_shape(kind == "bus" ? bus_mesh() : kind == "van" ? van_mesh(random_) : car_mesh(random_));
        add_actor(std::make_unique<Vehicle>(kind, std::move(motions[i]), terrain_, shape));
    }
}

World SceneBuilder::finish() {
    add_crowd(options_.crowd);
    world_.robot = RobotMotion(path_, terrain_, options_.robot, options_.duration_s);
    if (!options_.movers) walkers_.clear();
    std::vector<Motion> motions = walk_crowd(walkers_, obstacles_, world_.robot, options_.duration_s);
    for (std::size_t i = 0; i < motions.size(); ++i) {
        switch (kinds_[i]) {
            case Kind::kPerson:
                add_actor(std::make_unique<Person>(std::move(motions[i]), terrain_, random_));
                break;
            case Kind::kDog:
                add_actor(std::make_unique<Dog>(std::move(motions[i]), terrain_, random_));
                break;
            case Kind::kCyclist:
                if (bicycle_frame_ < 0) {
                    bicycle_frame_ = add_shape(bicycle_frame_mesh());
                    bicycle_wheel_ = add_shape(bicycle_wheel_mesh());
                }
                add_actor(std::make_unique<Cyclist>(std::move(motions[i]), terrain_, bicycle_frame_, bicycle_wheel_,
                                                    random_));
                break;
        }
    }
    return std::move(world_);
}

}  // namespace dlod::tools::sim
