// The shape of a detection: box by PCA, centroid, height, and on which sides a nearer surface hides its extent.
#pragma once

#include <span>

#include "core/types/frame.hpp"

namespace dlod {

/// Fills box, centroid_m and height_m from the deskewed cloud at `pixels`, in the world frame. The box is upright: its
/// length axis is the larger principal axis of the points in the ground plane, yaw in (-pi/2, pi/2] (PCA knows no
/// front).
void measure_shape(std::span<const PixelIndex> pixels, const OdometryResult& odometry, Detection& detection);

/// Sets occluded_left and occluded_right: on at least half of the rows the nearest return beyond the detection's end in
/// that direction is nearer than the detection by `min_step_m`. Left is towards smaller columns.
/// @param pixels of one detection, row-major order within each row not required
/// @param row_ends scratch, at least 2 * height entries
void mark_occlusion(std::span<const PixelIndex> pixels, const Image<float>& range_m, double min_step_m,
                    std::span<int> row_ends, Detection& detection);

}  // namespace dlod
