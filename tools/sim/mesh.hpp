// Triangle meshes and the simple bodies that everything is built of.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "tools/sim/material.hpp"

namespace dlod::tools::sim {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;

/// Triangles with a material each; metres.
class Mesh {
  public:
    std::vector<Eigen::Vector3f> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<Material> materials;  ///< [triangles]

    void add_triangle(const Vec3& a, const Vec3& b, const Vec3& c, Material material);
    /// Corners in turn.
    void add_quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, Material material);
    /// Upright box turned by `yaw_rad`; `size_m` along its own axes.
    void add_box(const Vec3& center, const Vec3& size_m, double yaw_rad, Material material);
    /// Box in its own frame.
    void add_box(const Eigen::Isometry3d& T, const Vec3& size_m, Material material);
    /// Round bar between two points, with ends.
    void add_bar(const Vec3& from, const Vec3& to, double radius_m, Material material, int sides = 8);
    /// Body of revolution about +z at `base`: pairs (height, radius), from below.
    void add_lathe(const Vec3& base, std::span<const std::pair<double, double>> profile, int sides, Material material);
    void add_ellipsoid(const Vec3& center, const Vec3& radii_m, int sides, Material material);
    /// Upright prism over a polygon with a flat top; `outline` counter-clockwise.
    void add_prism(std::span<const Vec2> outline, double z_low, double z_high, Material side, Material top);
    void append(const Mesh& other, const Eigen::Affine3d& T);
};

}  // namespace dlod::tools::sim
