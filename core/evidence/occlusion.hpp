// Which sides of a detection a nearer surface hides.
#pragma once

#include <span>

#include "core/types/frame.hpp"

namespace dlod {

/// Sets occluded_left and occluded_right: on at least half of the detection's rows the nearest return beyond its end in
/// that direction is nearer than its own by `min_step_m`. Left is towards smaller columns.
/// @param row_ends scratch, at least 2 * height entries
void mark_occlusion(std::span<const PixelIndex> pixels, const Image<float>& range_m, double min_step_m,
                    std::span<int> row_ends, Detection& detection);

}  // namespace dlod
