// The points that a frame leaves behind when it becomes a keyframe.
#pragma once

#include "core/odometry/feedback.hpp"
#include "core/registration/placed_point.hpp"
#include "core/registration/sweep_motion.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// All points of a scan, in the local frame that the motion leads to: the world moved to origin_m.
inline void build_keyframe_cloud(const PointSelection& points, const SweepMotion& motion,
                                 const Eigen::Vector3d& origin_m, KeyframeCloud& cloud) {
    cloud.clear();
    cloud.T_world_sensor = Eigen::Translation3d(origin_m);
    for (std::size_t i = 0; i < points.size(); ++i) {
        float T[12];
        motion.at(points.time_s[i], T);
        cloud.push(place(T, points.x[i], points.y[i], points.z[i]).position,
                   place(T, points.nx[i], points.ny[i], points.nz[i]).lever);
    }
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
        float T[12];
        for (std::size_t k = 0; k < 12; ++k) T[k] = frame.odometry.deskew[k][points.measurement[i]];
        cloud.push(place(T, points.x[i], points.y[i], points.z[i]).position,
                   place(T, points.nx[i], points.ny[i], points.nz[i]).lever);
    }
}

}  // namespace dlod
