// From the visible part of an object to the box of the whole of it.
#pragma once

#include "core/tracking/kalman_filter.hpp"

namespace dlod {

/// What hides parts of an object.
struct Visibility {
    Eigen::Vector3d sensor_m = Eigen::Vector3d::Zero();  ///< where it was seen from, world frame
    bool occluded_left = false;                          ///< a nearer surface borders it, seen from the sensor
    bool occluded_right = false;
};

/// Box of the whole object from its visible box and the remembered one, axis by axis in the ground plane:
/// the end towards the sensor is seen and anchors the box, the far end hides behind it, ends next to an occluder are
/// frozen, and what is missing from the remembered size is filled in on the hidden side. A side seen from end to end
/// is measured; of a hidden one only growth is. Yaw noise is left at "not seen".
/// @param visible at the yaw of `remembered`
BoxMeasurement complete_extent(const OrientedBox& visible, const OrientedBox& remembered, const Visibility& visibility,
                               const KalmanConfig& config);

/// Size of a new object: as seen, but with a depth that is at least half of its width up to that of a car: what is seen
/// from one side only is not flat.
OrientedBox assumed_box(const OrientedBox& visible, const Visibility& visibility);

}  // namespace dlod
