// Pictures of one frame in the layout of its image: one panorama, a turn wide.
#pragma once

#include <opencv2/core.hpp>

#include "core/types/frame.hpp"
#include "core/types/sensor_model.hpp"

namespace dlod::tools {

/// Range as brightness, pixels labelled dynamic red and undecided orange, the tracks' boxes over it with their ids.
cv::Mat draw_range_image(const Frame& frame, const SensorModel& sensor);

/// The residual image as colours from 0 (dark) to `scale_m` and beyond (bright), pixels without a residual black.
cv::Mat draw_residual_image(const Image<float>& residual_m, double scale_m);

}  // namespace dlod::tools
