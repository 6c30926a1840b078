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

/// Copies the frame's selected points, deskewed, without those whose pixel belongs to something that may move.
/// @param is_moving_pixel bool(PixelIndex)
template <class Predicate>
void build_keyframe_cloud(const Frame& frame, Predicate&& is_moving_pixel, KeyframeCloud& cloud) {
    cloud.clear();
    cloud.T_world_sensor = frame.odometry.T_world_sensor;
    const PointSelection& points = frame.prepared.points;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (is_moving_pixel(points.pixel[i])) continue;
        const std::size_t m = points.measurement[i];
        const auto rotate = [&](std::size_t row, float x, float y, float z) {
            const auto* d = &frame.odometry.deskew[4 * row];
            return d[0][m] * x + d[1][m] * y + d[2][m] * z;
        };
        float position[3];
        float normal[3];
        for (std::size_t row = 0; row < 3; ++row) {
            position[row] = rotate(row, points.x[i], points.y[i], points.z[i]) + frame.odometry.deskew[4 * row + 3][m];
            normal[row] = rotate(row, points.nx[i], points.ny[i], points.nz[i]);
        }
        cloud.push(position, normal);
    }
}

}  // namespace dlod
