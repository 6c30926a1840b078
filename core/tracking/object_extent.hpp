// From the visible part of an object to the box of the whole of it.
#pragma once

#include "core/tracking/kalman_filter.hpp"

namespace dlod {

/// What hides parts of an object.
struct Visibility {
    Eigen::Vector3d sensor_m = Eigen::Vector3d::Zero();  ///< where it was seen from, world frame
    bool occluded_left = false;                          ///< a nearer surface borders it, seen from the sensor
    bool occluded_right = false;

    /// Both ends of what is seen are edges of something nearer: it seems to move as these do, whatever it does itself.
    bool through_gap() const { return occluded_left && occluded_right; }
};

/// How much longer an object has proved to be than was known, at each end of its axes, metres.
struct Growth {
    double front = 0.0, back = 0.0, left = 0.0, right = 0.0;
};

/// What a sighting says about the whole object.
struct ExtentMeasurement {
    Growth growth;       ///< comes first: it is no motion
    BoxMeasurement box;  ///< of the object that has grown
};

/// Box of the whole object from its visible box and the remembered one, axis by axis in the ground plane. An end that
/// is seen says where the object is; the far end hides behind it, ends next to an occluder are hidden too. A side seen
/// from end to end is measured. Where more of an object comes into view than was known it has grown at its hidden end:
/// that moves its middle, but is no motion. Yaw noise is left at "not seen".
/// @param visible at the yaw of `remembered`
/// @param moves the object is known to move: what is low may be a limb of it, its height is remembered
/// @param before_m size of the visible box of the sighting before: growth must be seen twice
ExtentMeasurement complete_extent(const OrientedBox& visible, const Eigen::Vector3d& before_m,
                                  const OrientedBox& remembered, const Visibility& visibility, bool moves,
                                  const KalmanConfig& config);

/// What is missing from a moving object that has been seen from one side only, at the ends that hide: nothing is flat,
/// and what is as wide and as fast as a vehicle is as long as one.
/// @param visible_m size of what was seen in the last sighting, at the box's yaw
/// @param speed_mps along the box's yaw
Growth assumed_growth(const OrientedBox& box, const Eigen::Vector3d& visible_m, double speed_mps,
                      const Visibility& visibility);

/// What of a remembered box lies beyond the part that proved to be the whole object, at each end (negative), where two
/// objects were taken for one.
/// @param part at the yaw of `remembered`
Growth surplus(const OrientedBox& remembered, const OrientedBox& part);

/// How far a part of the object that was not known to be one reaches beyond a remembered box, at each end.
Growth enclosing_growth(const OrientedBox& remembered, const OrientedBox& part);

/// Size of a new object: as seen, but with a depth that is at least half of its width up to that of a car: what is seen
/// from one side only is not flat.
OrientedBox assumed_box(const OrientedBox& visible, const Visibility& visibility);

}  // namespace dlod
