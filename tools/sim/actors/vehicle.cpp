#include "tools/sim/actors/vehicle.hpp"

#include <algorithm>
#include <cmath>

#include "core/types/lie.hpp"

namespace dlod::tools::sim {
namespace {

void add_wheels(Mesh& m, double front_x, double rear_x, double half_width, double radius) {
    for (const double x : {front_x, rear_x}) {
        for (const double side : {-1.0, 1.0}) {
            const Vec3 hub(x, side * (half_width - 0.1), radius);
            m.add_bar(hub - Vec3(0.0, 0.1, 0.0), hub + Vec3(0.0, 0.1, 0.0), radius, Material::kRubber, 14);
        }
    }
}

/// A cabin whose sides lean in: pairs of (x, z, half width) below and above, panes of glass between pillars of paint.
void add_side_profile(Mesh& m, const std::vector<Vec2>& outline, double half_low, double half_high, double z_low,
                      double z_high, Material paint) {
    const auto half = [&](double z) {
        const double f = std::clamp((z - z_low) / (z_high - z_low), 0.0, 1.0);
        return half_low + f * (half_high - half_low);
    };
    const auto at = [&](const Vec2& p, double side) { return Vec3(p.x(), side * half(p.y()), p.y()); };
    for (std::size_t i = 0; i < outline.size(); ++i) {
        const Vec2& a = outline[i];
        const Vec2& b = outline[(i + 1) % outline.size()];
        // Steep pieces above the waist are windscreens.
        const bool screen = std::min(a.y(), b.y()) >= z_low - 1e-6 && std::abs(a.y() - b.y()) > 0.2;
        m.add_quad(at(a, -1.0), at(b, -1.0), at(b, 1.0), at(a, 1.0), screen ? Material::kGlass : paint);
    }
    Vec2 middle = Vec2::Zero();
    for (const Vec2& p : outline) middle += p / static_cast<double>(outline.size());
    for (const double side : {-1.0, 1.0}) {
        for (std::size_t i = 0; i < outline.size(); ++i) {
            m.add_triangle(at(middle, side), at(outline[i], side), at(outline[(i + 1) % outline.size()], side), paint);
        }
    }
}

Material random_paint(Random& random) {
    return random.chance(0.7) ? Material::kLightPaint : Material::kDarkPaint;
}

}  // namespace

Mesh car_mesh(Random& random) {
    Mesh m;
    const double length = random.uniform(3.9, 4.8);
    const double half = 0.5 * random.uniform(1.72, 1.88);
    const double height = random.uniform(1.42, 1.65);
    const double waist = 0.58 * height;
    const Material paint = random_paint(random);
    const double f = 0.5 * length;
    add_side_profile(
        m, {{-f, 0.35}, {f - 0.1, 0.22}, {f, 0.45}, {f - 0.12, 0.72}, {0.28 * f, waist}, {-f + 0.05, waist}, {-f, 0.6}},
        half, half, waist, height, paint);
    const double rear = random.chance(0.5) ? -f + 0.1 : -0.75 * f;
    add_side_profile(m, {{0.45 * f, waist}, {0.1 * f, height}, {rear + 0.35, height}, {rear, waist}}, half - 0.02,
                     half - 0.2, waist, height, paint);
    for (const double side : {-1.0, 1.0}) {  // side windows, just outside of the cabin
        const auto at = [&](double x, double share) {
            return Vec3(x, side * (half - 0.015 - 0.18 * share + 0.012), waist + share * (height - waist));
        };
        m.add_quad(at(0.32 * f, 0.12), at(0.1 * f, 0.85), at(-0.25 * f, 0.85), at(-0.25 * f, 0.12), Material::kGlass);
        m.add_quad(at(-0.3 * f, 0.12), at(-0.3 * f, 0.85), at(rear + 0.4, 0.85), at(rear + 0.25, 0.12),
                   Material::kGlass);
        m.add_box(Vec3(0.38 * f, side * (half + 0.08), waist + 0.08), Vec3(0.12, 0.18, 0.12), 0.0, paint);
        m.add_box(Vec3(-f - 0.005, side * (half - 0.25), 0.7), Vec3(0.02, 0.25, 0.12), 0.0, Material::kRetroreflector);
    }
    m.add_box(Vec3(f - 0.01, 0.0, 0.45), Vec3(0.04, 0.52, 0.11), 0.0, Material::kRetroreflector);
    m.add_box(Vec3(-f + 0.01, 0.0, 0.62), Vec3(0.04, 0.52, 0.11), 0.0, Material::kRetroreflector);
    add_wheels(m, 0.62 * f, -0.6 * f, half, 0.32);
    return m;
}

Mesh van_mesh(Random& random) {
    Mesh m;
    const double f = 0.5 * random.uniform(5.0, 6.2);
    const double half = 1.0;
    const double height = random.uniform(2.1, 2.6);
    const Material paint = random_paint(random);
    add_side_profile(m, {{-f, 0.35}, {f - 0.05, 0.3}, {f, 0.8}, {f - 0.7, 1.15}, {f - 1.35, height}, {-f, height}},
                     half, half - 0.1, 1.15, height, paint);
    for (const double side : {-1.0, 1.0}) {
        const auto at = [&](double x, double z) { return Vec3(x, side * (half + 0.012 - 0.1 * (z - 1.15) / 1.2), z); };
        m.add_quad(at(f - 0.95, 1.2), at(f - 1.4, 1.75), at(f - 2.0, 1.75), at(f - 2.0, 1.2), Material::kGlass);
    }
    m.add_box(Vec3(-f, 0.0, 0.6), Vec3(0.04, 0.52, 0.11), 0.0, Material::kRetroreflector);
    add_wheels(m, f - 0.95, -f + 1.1, half, 0.34);
    return m;
}

Mesh bus_mesh() {
    Mesh m;
    constexpr double kLength = 12.0;
    constexpr double kWidth = 2.55;
    constexpr double kHeight = 3.05;
    m.add_box(Vec3(0.0, 0.0, 0.5 * (kHeight + 0.35)), Vec3(kLength, kWidth, kHeight - 0.35), 0.0,
              Material::kLightPaint);
    for (const double side : {-1.0, 1.0}) {
        for (int i = 0; i < 7; ++i) {
            const double x = -5.7 + 1.65 * i;
            const double y = side * (0.5 * kWidth + 0.01);
            m.add_quad(Vec3(x, y, 1.25), Vec3(x + 1.45, y, 1.25), Vec3(x + 1.45, y, 2.45), Vec3(x, y, 2.45),
                       Material::kGlass);
        }
    }
    const double x = 0.5 * kLength + 0.01;
    m.add_quad(Vec3(x, -1.15, 1.1), Vec3(x, 1.15, 1.1), Vec3(x, 1.15, 2.6), Vec3(x, -1.15, 2.6), Material::kGlass);
    add_wheels(m, 3.4, -2.9, 0.5 * kWidth, 0.48);
    return m;
}

Vehicle::Vehicle(std::string kind, Motion motion, Terrain terrain, int shape)
    : Actor(std::move(kind), std::move(motion), std::move(terrain)) {
    parts_.push_back({.shape = shape, .own_materials = true});
}

void Vehicle::place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const {
    constexpr double kHalfWheelBase_m = 1.3;
    const Eigen::Isometry3d T = base(t);
    const Vec3 front = T * Vec3(kHalfWheelBase_m, 0.0, 0.0);
    const Vec3 rear = T * Vec3(-kHalfWheelBase_m, 0.0, 0.0);
    const double rise = ground(front.x(), front.y()) - ground(rear.x(), rear.y());
    T_world_part[0] = T * Eigen::AngleAxisd(-std::atan2(rise, 2.0 * kHalfWheelBase_m), Vec3::UnitY());
}

}  // namespace dlod::tools::sim
