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

/// The normals are from windows of the image, whose pixels were fired one after another: what the sensor came nearer
/// meanwhile, of a surface ahead, has turned it, by v / (2 pi f d) at the distance d with f turns a second. With the
/// gradient of the firing time this is undone.
/// Moves the first `count` points; the others' values are undefined. Fast when neighbours in the selection were fired
/// at similar times.
void place(const PointSelection& points, std::size_t count, const SweepMotion& motion, PlacedPoints& placed);

/// Moves all points.
inline void place(const PointSelection& points, const SweepMotion& motion, PlacedPoints& placed) {
    place(points, points.size(), motion, placed);
}

}  // namespace dlod
