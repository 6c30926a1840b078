// What a frame shows where a track is expected but was not found.
#pragma once

#include "core/projection/sweep_projection.hpp"
#include "core/types/frame.hpp"

namespace dlod {

enum class Sight {
    kUnknown,  ///< outside of the image, or no return
    kNearer,   ///< something nearer hides it
    kThere,    ///< something is at its place
    kFarther,  ///< its place is empty: what lies behind is seen
};

/// Looks at some places of the box, and takes what most of them say.
/// @param projection set to the frame's pose
Sight look_at(const OrientedBox& box, const Frame& frame, const SweepProjection& projection);

}  // namespace dlod
