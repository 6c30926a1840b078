#pragma once

#include <Eigen/Core>

#include <cmath>

namespace dlod {

/// A box that stands upright: turned about the vertical axis only.
struct OrientedBox {
    Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
    double yaw_rad = 0.0;                            ///< direction of the length axis, about +z
    Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  ///< length (along yaw), width, height

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

}  // namespace dlod
