// Intersection over union of upright boxes (d_1 of Eq. 5), and how else two boxes lie to one another.
#pragma once

#include "core/types/oriented_box.hpp"

namespace dlod {

/// Area [m^2] that the footprints of two boxes share: the rotated rectangles are clipped exactly.
double footprint_intersection_m2(const OrientedBox& a, const OrientedBox& b);

/// Intersection over union of the footprints, 0 to 1.
double footprint_iou(const OrientedBox& a, const OrientedBox& b);

/// Intersection over union of the volumes, 0 to 1: footprints clipped exactly, times the overlap of the heights.
double box_iou(const OrientedBox& a, const OrientedBox& b);

/// Distance [m] in the ground plane from a point to a box, 0 inside.
double footprint_distance_m(const OrientedBox& box, const Eigen::Vector3d& point_m);

/// How far two boxes together reach along and across a direction in the ground plane, metres.
Eigen::Vector2d joint_size(const OrientedBox& a, const OrientedBox& b, double yaw_rad);

/// Share of a part's footprint that lies inside of a box with a margin.
double share_inside(const OrientedBox& part, OrientedBox box, double margin_m);

}  // namespace dlod
