// Corridors around a core, rooms on both sides with doorways and furniture, doors that open, people who pass.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/sim/actors/door.hpp"
#include "tools/sim/scene_builder.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kHeight = 2.8;
constexpr double kHalfCorridor = 1.35;
constexpr double kWall = 0.14;
constexpr double kRoomDepth = 5.0;
constexpr double kDoorWidth = 0.95;
constexpr double kDoorHeight = 2.05;
const Vec2 kRing(20.0, 11.0);  ///< half the size of the rectangle that the corridors' middles form

void add_wall(SceneBuilder& b, const Vec2& from, const Vec2& to, double low, double high) {
    const Vec2 d = to - from;
    if (d.norm() < 0.01) return;
    const Vec2 middle = 0.5 * (from + to);
    b.mesh().add_box(Vec3(middle.x(), middle.y(), 0.5 * (low + high)), Vec3(d.norm(), kWall, high - low),
                     std::atan2(d.y(), d.x()), Material::kPlaster);
    if (low < 1.0) b.obstacles().push_back(Obstacle::wall(from, to, kWall));
}

/// A way through a wall: just outside of it on either side.
struct Doorway {
    Vec2 corridor;
    Vec2 room;
};

class Building {
  public:
    explicit Building(SceneBuilder& b) : b_(b) {}

    /// Rooms along a corridor's wall from a to b, to the right of that direction, `depth_m` deep.
    void add_rooms(const Vec2& from, const Vec2& to, double depth_m) {
        const Vec2 d = (to - from).normalized();
        const Vec2 out(d.y(), -d.x());
        const double length = (to - from).norm();
        const int rooms = std::max(1, static_cast<int>(length / b_.random().uniform(4.5, 6.5)));
        for (int i = 0; i < rooms; ++i) {
            const double u0 = length * i / rooms;
            const double u1 = length * (i + 1) / rooms;
            add_room(from + d * u0, from + d * u1, out, depth_m);
            add_wall(b_, from + d * u1, from + d * u1 + out * depth_m, 0.0, kHeight);
        }
        add_wall(b_, from, from + out * depth_m, 0.0, kHeight);
        add_wall(b_, from + out * depth_m, to + out * depth_m, 0.0, kHeight);
    }

    const std::vector<Doorway>& doorways() const { return doorways_; }
    /// Middles of all doors, also of those that are closed.
    const std::vector<Vec2>& doors() const { return doors_; }

  private:
    void add_room(const Vec2& from, const Vec2& to, const Vec2& out, double depth_m) {
        Random& random = b_.random();
        const Vec2 d = (to - from).normalized();
        const double width = (to - from).norm();
        const double at = random.uniform(0.4, width - kDoorWidth - 0.4);
        const Vec2 left = from + d * at;
        const Vec2 right = left + d * kDoorWidth;
        add_wall(b_, from, left, 0.0, kHeight);
        add_wall(b_, right, to, 0.0, kHeight);
        add_wall(b_, left, right, kDoorHeight, kHeight);
        const Vec2 middle = 0.5 * (left + right);
        const double along = std::atan2(d.y(), d.x());
        doors_.push_back(middle);
        for (const Vec2& jamb : {left, right}) {
            b_.mesh().add_box(Vec3(jamb.x(), jamb.y(), 0.5 * kDoorHeight), Vec3(0.08, kWall + 0.06, kDoorHeight), along,
                              Material::kMetal);
        }
        const double kind = random.uniform();
        if (kind < 0.13) {  // closed for good
            const Vec2 leaf = middle + out * 0.05;
            b_.mesh().add_box(Vec3(leaf.x(), leaf.y(), 0.5 * kDoorHeight), Vec3(kDoorWidth, 0.05, kDoorHeight), along,
                              Material::kWood);
            b_.obstacles().push_back(Obstacle::wall(left, right, kWall));
        } else if (kind < 0.25 && b_.options().movers) {
            add_door(left + out * 0.05, along);
        } else if (kind < 0.6) {  // stands open
            const Vec2 leaf = left + out * (0.5 * kDoorWidth + 0.06);
            b_.mesh().add_box(Vec3(leaf.x(), leaf.y(), 0.5 * kDoorHeight), Vec3(kDoorWidth, 0.05, kDoorHeight),
                              std::atan2(out.y(), out.x()), Material::kWood);
            doorways_.push_back({middle - out * 0.9, middle + out * 1.2});
        } else {
            doorways_.push_back({middle - out * 0.9, middle + out * 1.2});
        }
        furnish(from, d, out, width, depth_m);
    }

    /// A door that opens into the room and closes again.
    void add_door(const Vec2& hinge, double along) {
        constexpr double kStep_s = 0.02;
        Random& random = b_.random();
        const double duration = b_.options().duration_s;
        std::vector<Eigen::Vector4d> samples;
        const double opens = random.uniform(0.5, std::max(1.0, 0.6 * duration));
        const double open_s = random.uniform(2.0, 5.0);
        for (double t = -1.0; t <= duration + 1.0; t += kStep_s) {
            const double swing = 1.2;
            const double in = std::clamp((t - opens) / swing, 0.0, 1.0);
            const double back = std::clamp((t - opens - open_s) / swing, 0.0, 1.0);
            const double angle = -1.5 * (in - back);  // to the right of the wall's direction: into the room
            samples.emplace_back(hinge.x(), hinge.y(), along + angle, 0.0);
        }
        b_.add_actor(std::make_unique<Door>(Motion(-1.0, kStep_s, smoothed(samples, 6.0)), b_.terrain(), kDoorWidth,
                                            kDoorHeight));
    }

    void furnish(const Vec2& from, const Vec2& d, const Vec2& out, double width, double depth_m) {
        Random& random = b_.random();
        const double yaw = std::atan2(out.y(), out.x());
        const auto at = [&](double u, double v) {
            const Vec2 p = from + d * u + out * v;
            return Vec3(p.x(), p.y(), 0.0);
        };
        const auto along = [&] { return random.uniform(0.7, width - 0.7); };
        for (int i = random.integer(1, 2); i > 0; --i) {
            add_desk_and_chair(b_.stage(), at(along(), depth_m - random.uniform(0.7, 1.8)),
                               yaw + std::numbers::pi + random.uniform(-0.2, 0.2));
        }
        add_cabinet(b_.stage(), at(along(), depth_m - 0.35), yaw);
        if (random.chance(0.5)) add_plant(b_.stage(), at(random.chance(0.5) ? 0.5 : width - 0.5, depth_m - 0.5));
        if (random.chance(0.3)) add_sofa(b_.stage(), at(0.7, 0.5 * depth_m), yaw - 0.5 * std::numbers::pi);
        if (random.chance(0.4)) add_boxes(b_.stage(), at(width - 0.6, random.uniform(1.2, depth_m - 1.0)));
        // A window in the outer wall.
        const Vec3 pane = at(0.5 * width, depth_m - 0.5 * kWall - 0.01);
        b_.mesh().add_box(pane + Vec3(0.0, 0.0, 1.6), Vec3(0.01, 0.6 * width, 1.2), yaw, Material::kGlass);
    }

    SceneBuilder& b_;
    std::vector<Doorway> doorways_;
    std::vector<Vec2> doors_;
};

/// What stands along the corridors' walls.
void add_corridor_furniture(SceneBuilder& b, const std::vector<Vec2>& doors) {
    Random& random = b.random();
    for (int i = 0; i < 24; ++i) {
        const bool lengthwise = i % 2 == 0;
        const double side = random.sign();
        const double off = random.sign() * (kHalfCorridor - 0.35);
        const Vec2 p = lengthwise ? Vec2(random.uniform(-16.0, 16.0), side * kRing.y() + off)
                                  : Vec2(side * kRing.x() + off, random.uniform(-7.0, 7.0));
        const bool blocks_door =
            std::any_of(doors.begin(), doors.end(), [&](const Vec2& door) { return (door - p).norm() < 1.3; });
        if (blocks_door) continue;
        const Vec3 base(p.x(), p.y(), 0.0);
        const double yaw = (lengthwise ? 0.5 : 0.0) * std::numbers::pi;
        switch (random.integer(0, 3)) {
            case 0:
                add_cabinet(b.stage(), base, yaw);
                break;
            case 1:  // a pillar of the wall
                b.mesh().add_box(base + Vec3(0.0, 0.0, 0.5 * kHeight), Vec3(0.4, 0.5, kHeight), yaw,
                                 Material::kConcrete);
                b.obstacles().push_back(Obstacle::box(p, Vec2(0.4, 0.5), yaw));
                break;
            case 2:
                add_plant(b.stage(), base);
                break;
            default:
                add_boxes(b.stage(), base);
        }
    }
}

void add_people(SceneBuilder& b, const std::vector<Doorway>& doorways) {
    using Kind = SceneBuilder::Kind;
    Random& random = b.random();
    const Vec2 corners[4] = {
        {-kRing.x(), -kRing.y()}, {kRing.x(), -kRing.y()}, {kRing.x(), kRing.y()}, {-kRing.x(), kRing.y()}};
    for (int i = 0; i < 5; ++i) {  // around the corridors, either way, keeping to one side
        const bool forward = random.chance(0.5);
        const double off = forward ? -0.55 : 0.55;
        const int first = random.integer(0, 3);
        Walker w;
        for (int k = 0; k < 4; ++k) {
            const int c = ((forward ? first + k : first - k) % 4 + 4) % 4;
            w.route.push_back(corners[c] * (1.0 + off / corners[c].norm()));
        }
        w.start = w.route.back() + random.uniform(0.1, 0.9) * (w.route.front() - w.route.back());
        w.speed_mps = random.uniform(0.9, 1.6);
        w.reached_m = 0.9;
        b.add_walker(Kind::kPerson, w);
    }
    // Out of a room, along the corridor to where the robot comes by, and back.
    int count = 0;
    for (const Doorway& door : doorways) {
        if (count == 7 || !random.chance(0.55)) continue;
        ++count;
        const bool lengthwise = std::abs(std::abs(door.corridor.y()) - kRing.y()) < 2.0;
        const Vec2 way = lengthwise ? Vec2(random.uniform(3.0, 7.0), 0.0) : Vec2(0.0, random.uniform(3.0, 5.0));
        Walker w;
        w.start = door.room;
        w.speed_mps = random.uniform(0.8, 1.4);
        w.reached_m = 0.35;
        w.route = {door.room, door.corridor, door.corridor + random.sign() * way, door.corridor};
        w.pause_s = {random.uniform(4.0, 7.0), 0.0, random.chance(0.5) ? 2.5 : 0.0, 0.0};
        b.add_walker(Kind::kPerson, w);
    }
}

}  // namespace

World build_corridor(const SceneOptions& options) {
    SceneBuilder b(options, 2);
    const double first = b.random().uniform(-14.0, 4.0);
    b.set_path(ArcPath({Vec2(first, -kRing.y()), Vec2(kRing.x(), -kRing.y()), Vec2(kRing.x(), kRing.y()),
                        Vec2(-kRing.x(), kRing.y()), Vec2(-kRing.x(), -kRing.y())},
                       true, 0.9));
    const Vec2 all = kRing + Vec2::Constant(kHalfCorridor + kRoomDepth + 1.0);
    b.add_ground({-all, all}, 4.0, Material::kIndoorFloor);
    b.mesh().add_box(Vec3(0.0, 0.0, kHeight + 0.1), Vec3(2.0 * all.x(), 2.0 * all.y(), 0.2), 0.0, Material::kPlaster);

    Building building(b);
    const auto ring = [&](double off, double sx, double sy) {
        return Vec2(sx * (kRing.x() + off), sy * (kRing.y() + off));
    };
    // Outer rooms lie to the right of clockwise walls seen from inside, inner ones the other way round.
    const double o = kHalfCorridor;
    building.add_rooms(ring(o, -1, -1), ring(o, 1, -1), kRoomDepth);
    building.add_rooms(ring(o, 1, -1), ring(o, 1, 1), kRoomDepth);
    building.add_rooms(ring(o, 1, 1), ring(o, -1, 1), kRoomDepth);
    building.add_rooms(ring(o, -1, 1), ring(o, -1, -1), kRoomDepth);
    building.add_rooms(ring(-o, 1, -1), ring(-o, -1, -1), 4.5);
    building.add_rooms(ring(-o, -1, 1), ring(-o, 1, 1), 4.5);
    add_wall(b, ring(-o, 1, -1), ring(-o, 1, 1), 0.0, kHeight);
    add_wall(b, ring(-o, -1, -1), ring(-o, -1, 1), 0.0, kHeight);
    add_corridor_furniture(b, building.doors());
    for (int i = 0; i < 30; ++i) {  // boards and radiators on the walls
        const bool lengthwise = i % 3 != 0;
        const double side = b.random().sign();
        const double off = b.random().sign() * (kHalfCorridor - 0.11);
        const Vec2 p = lengthwise ? Vec2(b.random().uniform(-18.0, 18.0), side * kRing.y() + off)
                                  : Vec2(side * kRing.x() + off, b.random().uniform(-9.0, 9.0));
        const bool on_door = std::any_of(building.doors().begin(), building.doors().end(),
                                         [&](const Vec2& door) { return (door - p).norm() < 1.2; });
        if (on_door) continue;
        const Vec3 size(b.random().uniform(0.6, 1.4), 0.1, b.random().uniform(0.4, 0.9));
        b.mesh().add_box(Vec3(p.x(), p.y(), b.random().chance(0.5) ? 1.5 : 0.5), size,
                         lengthwise ? 0.0 : 0.5 * std::numbers::pi, Material::kLightPaint);
    }
    for (double x = -18.0; x <= 18.0; x += 4.0) {  // lamps
        for (const double y : {-kRing.y(), kRing.y()}) {
            b.mesh().add_box(Vec3(x, y, kHeight - 0.04), Vec3(1.2, 0.25, 0.08), 0.0, Material::kPlastic);
        }
    }
    add_people(b, building.doorways());
    return b.finish();
}

}  // namespace dlod::tools::sim
