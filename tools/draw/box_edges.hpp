// Where the boxes of tracks are seen in a frame's image.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/types/frame.hpp"
#include "core/types/sensor_model.hpp"

namespace dlod::tools {

/// The twelve edges of the track's box as chains of pixels (column, row), cut where they leave the image. Within a
/// sweep sensor and object move on: each point is drawn where the column that looked at it met the object.
std::vector<std::vector<cv::Point>> box_edges(const Track& track, const SensorModel& sensor, const Frame& frame);

}  // namespace dlod::tools
