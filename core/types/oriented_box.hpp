#pragma once

#include <Eigen/Core>
#include <cmath>

namespace dlod {

/// A box that stands upright: turned about the vertical axis only.
struct OrientedBox {
    Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
    double yaw_rad = 0.0;                              ///< direction of the length axis, about +z
    Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  ///< length (along yaw), width, height

    /// The longer side of the footprint.
    double longest_m() const { return size_m.head<2>().maxCoeff(); }
    /// True where the point lies inside the box grown by `margin_m` on every side.
    bool contains(const Eigen::Vector3d& p, double margin_m = 0.0) const {
        const Eigen::Vector3d d = p - center_m;
        const double c = std::cos(yaw_rad);
        const double s = std::sin(yaw_rad);
        return std::abs(c * d.x() + s * d.y()) <= 0.5 * size_m.x() + margin_m &&
               std::abs(-s * d.x() + c * d.y()) <= 0.5 * size_m.y() + margin_m &&
               std::abs(d.z()) <= 0.5 * size_m.z() + margin_m;
    }
};

/// A box made ready for many points, in single precision.
struct PreparedBox {
    float center_m[3] = {}, half_m[3] = {}, cosine = 1.0F, sine = 0.0F;

    PreparedBox() = default;
    explicit PreparedBox(const OrientedBox& box, double margin_m = 0.0)
        : cosine(static_cast<float>(std::cos(box.yaw_rad))), sine(static_cast<float>(std::sin(box.yaw_rad))) {
        for (int i = 0; i < 3; ++i) {
            center_m[i] = static_cast<float>(box.center_m[i]);
            half_m[i] = static_cast<float>(0.5 * box.size_m[i] + margin_m);
        }
    }
    /// Without a branch: loops over points can be vectorised.
    bool contains(float x, float y, float z) const {
        const float dx = x - center_m[0], dy = y - center_m[1], dz = z - center_m[2];
        const bool along = std::abs(cosine * dx + sine * dy) <= half_m[0];
        const bool across = std::abs(cosine * dy - sine * dx) <= half_m[1];
        return along & across & (std::abs(dz) <= half_m[2]);
    }
};

}  // namespace dlod
