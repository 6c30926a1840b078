// The points that a frame leaves behind when it becomes a keyframe.
#pragma once

#include "core/odometry/feedback.hpp"
#include "core/registration/placed_points.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// All points of a scan, in a local frame: the world moved to origin_m.
inline void build_keyframe_cloud(const PlacedPoints& placed, const Eigen::Vector3d& origin_m, KeyframeCloud& cloud) {
    cloud.T_world_sensor = Eigen::Translation3d(origin_m);
    cloud.x = placed.x;
    cloud.y = placed.y;
    cloud.z = placed.z;
    cloud.nx = placed.nx;
    cloud.ny = placed.ny;
    cloud.nz = placed.nz;
}

/// Copies a keyframe's points without those whose pixel belongs to something that moves.
/// @param is_moving_pixel bool(PixelIndex)
template <class Predicate>
void build_keyframe_cloud(const Frame& frame, Predicate&& is_moving_pixel, KeyframeCloud& cloud) {
    cloud.clear();
    cloud.T_world_sensor = frame.odometry.T_world_sensor;
    const PointSelection& points = frame.prepared.points;
    const auto& p = frame.odometry.keyframe_points;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (is_moving_pixel(points.pixel[i])) continue;
        const float position[3] = {p[0][i], p[1][i], p[2][i]};
        const float normal[3] = {p[3][i], p[4][i], p[5][i]};
        cloud.push(position, normal);
    }
}

}  // namespace dlod
