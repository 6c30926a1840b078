#include "tools/sim/mesh.hpp"

#include <cmath>
#include <numbers>

namespace dlod::tools::sim {

void Mesh::add_triangle(const Vec3& a, const Vec3& b, const Vec3& c, Material material) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Vec3* v : {&a, &b, &c}) vertices.push_back(v->cast<float>());
    triangles.push_back({first, first + 1, first + 2});
    materials.push_back(material);
}

void Mesh::add_quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, Material material) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Vec3* v : {&a, &b, &c, &d}) vertices.push_back(v->cast<float>());
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
    materials.insert(materials.end(), 2, material);
}

void Mesh::add_box(const Vec3& center, const Vec3& size_m, double yaw_rad, Material material) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::AngleAxisd(yaw_rad, Vec3::UnitZ()).toRotationMatrix();
    T.translation() = center;
    add_box(T, size_m, material);
}

void Mesh::add_box(const Eigen::Isometry3d& T, const Vec3& size_m, Material material) {
    const auto corner = [&](int i) {
        const Vec3 sign((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5, (i & 4) != 0 ? 0.5 : -0.5);
        return Vec3(T * sign.cwiseProduct(size_m));
    };
    constexpr int kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& f : kFaces) add_quad(corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]), material);
}

void Mesh::add_bar(const Vec3& from, const Vec3& to, double radius_m, Material material, int sides) {
    const Vec3 axis = to - from;
    const double length = axis.norm();
    Mesh bar;
    const std::array<std::pair<double, double>, 4> profile{{{0.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}, {1.0, 0.0}}};
    bar.add_lathe(Vec3::Zero(), profile, sides, material);
    Eigen::Affine3d T = Eigen::Affine3d::Identity();
    T.linear() = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), axis).toRotationMatrix() *
                 Vec3(radius_m, radius_m, length).asDiagonal();
    T.translation() = from;
    append(bar, T);
}

void Mesh::add_lathe(const Vec3& base, std::span<const std::pair<double, double>> profile, int sides,
                     Material material) {
    const auto point = [&](std::size_t ring, int side) {
        const double angle = 2.0 * std::numbers::pi * side / sides;
        const auto [height, radius] = profile[ring];
        return Vec3(base + Vec3(radius * std::cos(angle), radius * std::sin(angle), height));
    };
    for (std::size_t ring = 0; ring + 1 < profile.size(); ++ring) {
        for (int side = 0; side < sides; ++side) {
            const Vec3 a = point(ring, side);
            const Vec3 b = point(ring, side + 1);
            const Vec3 c = point(ring + 1, side + 1);
            const Vec3 d = point(ring + 1, side);
            if (profile[ring].second == 0.0) {
                add_triangle(a, c, d, material);
            } else if (profile[ring + 1].second == 0.0) {
                add_triangle(a, b, d, material);
            } else {
                add_quad(a, b, c, d, material);
            }
        }
    }
}

void Mesh::add_ellipsoid(const Vec3& center, const Vec3& radii_m, int sides, Material material) {
    std::vector<std::pair<double, double>> profile;
    const int rings = sides / 2;
    for (int ring = 0; ring <= rings; ++ring) {
        const double angle = std::numbers::pi * ring / rings;
        const bool pole = ring == 0 || ring == rings;
        profile.emplace_back(-std::cos(angle), pole ? 0.0 : std::sin(angle));
    }
    Mesh sphere;
    sphere.add_lathe(Vec3::Zero(), profile, sides, material);
    Eigen::Affine3d T = Eigen::Affine3d::Identity();
    T.linear() = radii_m.asDiagonal();
    T.translation() = center;
    append(sphere, T);
}

void Mesh::add_prism(std::span<const Vec2> outline, double z_low, double z_high, Material side, Material top) {
    const auto at = [](const Vec2& p, double z) { return Vec3(p.x(), p.y(), z); };
    for (std::size_t i = 0; i < outline.size(); ++i) {
        const Vec2& a = outline[i];
        const Vec2& b = outline[(i + 1) % outline.size()];
        add_quad(at(a, z_low), at(b, z_low), at(b, z_high), at(a, z_high), side);
    }
    for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
        add_triangle(at(outline[0], z_high), at(outline[i], z_high), at(outline[i + 1], z_high), top);
    }
}

void Mesh::append(const Mesh& other, const Eigen::Affine3d& T) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Eigen::Vector3f& v : other.vertices) vertices.push_back((T * v.cast<double>()).cast<float>());
    for (const auto& t : other.triangles) triangles.push_back({first + t[0], first + t[1], first + t[2]});
    materials.insert(materials.end(), other.materials.begin(), other.materials.end());
}

}  // namespace dlod::tools::sim
