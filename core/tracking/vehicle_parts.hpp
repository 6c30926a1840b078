// Which detections and which tracks are parts of one vehicle: it is seen in pieces where something hides it, where its
// panes and its bonnet return nothing, and where evidence divides what moves slowly.
#pragma once

#include "core/projection/sweep_projection.hpp"
#include "core/tracking/detection_shapes.hpp"
#include "core/tracking/tracked_object.hpp"

namespace dlod {

/// Of a large object that moves slowly only the front stands where it was free: evidence divides it, but its track
/// knows its extent.
/// @param front, rest of one segment
bool is_rest_of(const TrackedObject& host, const Detection& front, const Detection& rest);

/// What rested as one vehicle sets off as one, even if its front alone stands where it was free.
/// @param seen, part of one segment
bool sets_off_with(const TrackedObject& host, const Detection& seen, const Detection& part);

/// Two parts of one segment that together are as large as a car or a van, of which the one is at the end of the other
/// and as wide as all of it: where it is free, it may be the front of a vehicle that moves so slowly that the rest
/// stands where it has just been itself. People beside a vehicle at rest are not as wide as it is.
bool is_at_front_of(const Detection& rest, const Detection& front);

/// The front moves, and no faster than the rest may: cyclists who cross before a vehicle at rest do.
bool is_front_of(const TrackedObject& rest, const TrackedObject& front);

/// Two tracks on one vehicle that an occluder divides: the one inside of the other, at the same velocity.
bool one_vehicle(const TrackedObject& whole, const TrackedObject& piece);

/// Two tracks at the same velocity that together are no larger than a car or a van, where nothing behind is seen
/// between them; at the speed of vehicles, or the lower one wider and lower than people are: bumper and windscreen.
/// Likewise what is seen through the panes of a vehicle that drives, and drives along: seats, and the far side.
/// @param projection set to the frame's pose
bool pieces_of_one_vehicle(const TrackedObject& a, const Detection& seen_a, const TrackedObject& b,
                           const Detection& seen_b, const Frame& frame, const DetectionShapes& shapes,
                           const SweepProjection& projection);

/// Two detections, both where it was free, that may be pieces of one vehicle of which nobody knows more yet: together
/// they are no larger than a car or a van and broader than people, neither is as tall and narrow as people and cyclists
/// are, and neither the ground nor anything behind is seen between them.
/// @param projection set to the frame's pose
bool may_be_one_vehicle(const Detection& a, const Detection& b, const Frame& frame, const SweepProjection& projection);

}  // namespace dlod
