// Intersection over union of upright boxes (d_1 of Eq. 5), and how else two boxes lie to one another.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/types/oriented_box.hpp"

namespace dlod {

/// Area [m^2] that the footprints of two boxes share: the rotated rectangles are clipped exactly.
double footprint_intersection_m2(const OrientedBox& a, const OrientedBox& b);

/// The same as a share of the smaller footprint, 0 to 1.
double shared_footprint(const OrientedBox& a, const OrientedBox& b);

/// Intersection over union of the footprints, 0 to 1.
double footprint_iou(const OrientedBox& a, const OrientedBox& b);

/// Intersection over union of the volumes, 0 to 1: footprints clipped exactly, times the overlap of the heights.
double box_iou(const OrientedBox& a, const OrientedBox& b);

/// The footprint of a box, made ready for many points.
class Footprint {
  public:
    explicit Footprint(const OrientedBox& box);
    /// Distance [m] in the ground plane to a point, 0 inside.
    double distance_m(const Eigen::Vector3d& point_m) const {
        const Eigen::Vector2d out = beyond(point_m);
        return out.x() == 0.0 || out.y() == 0.0 ? out.maxCoeff() : out.norm();
    }
    bool contains(const Eigen::Vector3d& point_m) const { return beyond(point_m).isZero(0.0); }

  private:
    /// How far the point lies beyond the sides, along and across.
    Eigen::Vector2d beyond(const Eigen::Vector3d& point_m) const {
        const Eigen::Vector3d d = point_m - center_m_;
        return {std::max(0.0, std::abs(cosine_ * d.x() + sine_ * d.y()) - half_length_m_),
                std::max(0.0, std::abs(-sine_ * d.x() + cosine_ * d.y()) - half_width_m_)};
    }

    Eigen::Vector3d center_m_;
    double cosine_, sine_, half_length_m_, half_width_m_;
};

/// Distance [m] in the ground plane from a point to a box, 0 inside.
double footprint_distance_m(const OrientedBox& box, const Eigen::Vector3d& point_m);

/// Distance [m] between one box and another above it, negative where their heights overlap.
double height_gap_m(const OrientedBox& a, const OrientedBox& b);

/// From the middle of a footprint to its corners, metres.
double reach_m(const OrientedBox& box);

/// How far a box reaches along a direction (unit) in the ground plane, metres.
double width_along(const OrientedBox& box, const Eigen::Vector2d& axis);

/// How far two boxes together reach along and across a direction in the ground plane, metres.
Eigen::Vector2d joint_size(const OrientedBox& a, const OrientedBox& b, double yaw_rad);

/// Share of a part's footprint that lies inside of a box with a margin.
double share_inside(const OrientedBox& part, OrientedBox box, double margin_m);

}  // namespace dlod
