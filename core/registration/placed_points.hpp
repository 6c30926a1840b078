// The points of a scan moved into the local frame of the registration.
#pragma once

#include "core/registration/sweep_motion.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Positions, levers and normals after the motion of the sweep, structure of arrays like the selection that they come
/// from.
struct PlacedPoints {
    AlignedVector<float> x, y, z;     ///< position, local frame
    AlignedVector<float> lx, ly, lz;  ///< from the sensor at the firing time to the point, local axes
    AlignedVector<float> nx, ny, nz;  ///< normal, local axes
    std::size_t size() const { return x.size(); }
};

/// Moves the first `count` points; the others' values are undefined. Fast when neighbours in the selection were fired
/// at similar times.
void place(const PointSelection& points, std::size_t count, const SweepMotion& motion, PlacedPoints& placed);

/// Moves all points.
inline void place(const PointSelection& points, const SweepMotion& motion, PlacedPoints& placed) {
    place(points, points.size(), motion, placed);
}

}  // namespace dlod
