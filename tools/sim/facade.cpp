#include "tools/sim/facade.hpp"

#include <algorithm>
#include <cmath>

namespace dlod::tools::sim {
namespace {

/// Coordinates on a wall: along it, up, and out of it.
class Wall {
  public:
    Wall(Mesh& mesh, const Vec2& a, const Vec2& b, double z) : mesh_(mesh), origin_(a.x(), a.y(), z) {
        const Vec2 d = (b - a).normalized();
        along_ = Vec3(d.x(), d.y(), 0.0);
        out_ = Vec3(d.y(), -d.x(), 0.0);
    }
    Vec3 at(double u, double v, double depth) const { return origin_ + along_ * u + Vec3(0.0, 0.0, v) - out_ * depth; }
    void rectangle(double u0, double u1, double v0, double v1, double depth, Material material) {
        if (u1 - u0 < 1e-3 || v1 - v0 < 1e-3) return;
        mesh_.add_quad(at(u0, v0, depth), at(u1, v0, depth), at(u1, v1, depth), at(u0, v1, depth), material);
    }
    /// Sides of an opening between two depths.
    void reveal(double u0, double u1, double v0, double v1, double near, double far, Material material) {
        const auto strip = [&](double ua, double va, double ub, double vb) {
            mesh_.add_quad(at(ua, va, near), at(ub, vb, near), at(ub, vb, far), at(ua, va, far), material);
        };
        strip(u0, v0, u1, v0);
        strip(u1, v0, u1, v1);
        strip(u1, v1, u0, v1);
        strip(u0, v1, u0, v0);
    }
    /// A box in front of the wall.
    void relief(double u0, double u1, double v0, double v1, double out, Material material) {
        rectangle(u0, u1, v0, v1, -out, material);
        reveal(u0, u1, v0, v1, -out, 0.0, material);
    }

  private:
    Mesh& mesh_;
    Vec3 origin_;
    Vec3 along_;
    Vec3 out_;
};

/// A cell of the wall with an opening in it: returns by leaving the pane to the caller.
void add_opening(Wall& wall, double u0, double u1, double v0, double v1, double a0, double a1, double b0, double b1,
                 double recess, Material material) {
    wall.rectangle(u0, u1, v0, b0, 0.0, material);
    wall.rectangle(u0, u1, b1, v1, 0.0, material);
    wall.rectangle(u0, a0, b0, b1, 0.0, material);
    wall.rectangle(a1, u1, b0, b1, 0.0, material);
    wall.reveal(a0, a1, b0, b1, 0.0, recess, material);
}

void add_window(Wall& wall, Random& random, double a0, double a1, double b0, double b1, const FacadeStyle& style) {
    const bool closed = random.chance(style.blinds);
    const double bar = 0.04;
    wall.rectangle(a0, a1, b0, b1, style.recess_m, closed ? Material::kPlastic : Material::kGlass);
    if (closed) return;
    const double middle = 0.5 * (a0 + a1);
    wall.rectangle(middle - bar, middle + bar, b0, b1, style.recess_m - 0.03, Material::kLightPaint);
    wall.rectangle(a0, a1, b0 + 0.62 * (b1 - b0) - bar, b0 + 0.62 * (b1 - b0) + bar, style.recess_m - 0.03,
                   Material::kLightPaint);
    wall.reveal(a0, a1, b0, b1, style.recess_m - 0.08, style.recess_m, Material::kLightPaint);
}

}  // namespace

FacadeStyle random_style(Random& random) {
    constexpr Material kWalls[] = {Material::kPlaster, Material::kBrick, Material::kConcrete};
    FacadeStyle s;
    s.floor_m = random.uniform(3.0, 3.8);
    s.floors = random.integer(2, 5);
    s.bay_m = random.uniform(2.3, 3.8);
    s.window_m = random.uniform(0.9, 1.6);
    s.window_height_m = random.uniform(1.4, 2.0);
    s.recess_m = random.uniform(0.12, 0.35);
    s.pillars = random.chance(0.35);
    s.ledges = random.chance(0.7);
    s.balconies = random.chance(0.4) ? random.uniform(0.1, 0.5) : 0.0;
    s.wall = kWalls[random.integer(0, 2)];
    return s;
}

void add_facade(Mesh& mesh, Random& random, const Vec2& a, const Vec2& b, double z, const FacadeStyle& style) {
    Wall wall(mesh, a, b, z);
    const double length = (b - a).norm();
    const int bays = std::max(1, static_cast<int>(std::lround(length / style.bay_m)));
    const double bay = length / bays;
    const double window = std::min(style.window_m, 0.8 * bay);
    for (int floor = 0; floor < style.floors; ++floor) {
        const double v0 = floor * style.floor_m;
        const double v1 = v0 + style.floor_m;
        for (int i = 0; i < bays; ++i) {
            const double u0 = i * bay;
            const double u1 = u0 + bay;
            const double middle = 0.5 * (u0 + u1);
            if (floor == 0 && random.chance(0.25)) {  // a door, set back, with a step
                const double half = std::min(random.uniform(0.55, 0.9), 0.42 * bay);
                const double top = v0 + random.uniform(2.2, 2.6);
                const double recess = random.uniform(0.25, 0.7);
                add_opening(wall, u0, u1, v0, v1, middle - half, middle + half, v0 + 0.02, top, recess, style.wall);
                wall.rectangle(middle - half, middle + half, v0, top, recess, Material::kWood);
                wall.relief(middle - half - 0.2, middle + half + 0.2, v0, v0 + 0.14, 0.35, Material::kConcrete);
                continue;
            }
            if (floor == 0 && random.chance(0.35)) {  // a shop window
                const double half = 0.42 * bay;
                add_opening(wall, u0, u1, v0, v1, middle - half, middle + half, v0 + 0.45, v0 + 2.5, style.recess_m,
                            style.wall);
                wall.rectangle(middle - half, middle + half, v0 + 0.45, v0 + 2.5, style.recess_m,
                               random.chance(0.5) ? Material::kGlass : Material::kMetal);
                continue;
            }
            const double b0 = v0 + 0.95;
            const double b1 = std::min(b0 + style.window_height_m, v1 - 0.3);
            add_opening(wall, u0, u1, v0, v1, middle - 0.5 * window, middle + 0.5 * window, b0, b1, style.recess_m,
                        style.wall);
            add_window(wall, random, middle - 0.5 * window, middle + 0.5 * window, b0, b1, style);
            wall.relief(middle - 0.5 * window - 0.1, middle + 0.5 * window + 0.1, b0 - 0.1, b0, 0.12,
                        Material::kConcrete);
            if (floor > 0 && random.chance(style.balconies)) {
                const double half = 0.48 * bay;
                wall.relief(middle - half, middle + half, v0 - 0.12, v0 + 0.04, 1.1, Material::kConcrete);
                wall.relief(middle - half, middle + half, v0 + 0.95, v0 + 1.0, 1.1, Material::kMetal);
                for (double u = middle - half; u < middle + half; u += 0.25) {
                    wall.rectangle(u, u + 0.04, v0, v0 + 1.0, -1.1, Material::kMetal);
                }
            }
        }
        if (style.ledges) wall.relief(0.0, length, v1 - 0.12, v1, floor + 1 == style.floors ? 0.4 : 0.14, style.wall);
    }
    if (style.pillars) {
        for (int i = 0; i <= bays; ++i) {
            const double u = std::clamp(i * bay, 0.2, length - 0.2);
            wall.relief(u - 0.2, u + 0.2, 0.0, style.floors * style.floor_m, 0.18, style.wall);
        }
    }
}

void add_house(Mesh& mesh, Random& random, const Vec2& a, const Vec2& b, double z, double depth_m,
               const FacadeStyle& style) {
    const Vec2 d = (b - a).normalized();
    const Vec2 back = Vec2(-d.y(), d.x()) * depth_m;
    add_facade(mesh, random, a, b, z, style);
    add_facade(mesh, random, b, b + back, z, style);
    add_facade(mesh, random, a + back, a, z, style);
    const double top = z + style.floors * style.floor_m;
    const double ridge = top + 0.35 * depth_m;
    const auto at = [](const Vec2& p, double height) { return Vec3(p.x(), p.y(), height); };
    const Vec2 half = 0.5 * back;
    mesh.add_quad(at(a, top), at(b, top), at(b + half, ridge), at(a + half, ridge), Material::kRoof);
    mesh.add_triangle(at(b, top), at(b + back, top), at(b + half, ridge), style.wall);
    mesh.add_triangle(at(a + back, top), at(a, top), at(a + half, ridge), style.wall);
    mesh.add_quad(at(b + back, z), at(a + back, z), at(a + back, top), at(b + back, top), style.wall);
}

}  // namespace dlod::tools::sim
