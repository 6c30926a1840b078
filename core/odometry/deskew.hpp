// Deskewing of the whole cloud: every point into the sensor frame at the frame's stamp.
#pragma once

#include "core/registration/sweep_motion.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Fills frame.odometry.deskew (by measurement; identity where the column was lost) and frame.odometry.x, y, z.
void deskew(const SensorModel& sensor, const SweepMotion& motion, Frame& frame);

}  // namespace dlod
