// Second stage of the registration: the scan against the voxels of the submap (paper, Sec. "Overview", Eq. 4).
//
// Each point looks up the one voxel that it falls into and is drawn to that voxel's plane. The scan's own covariances
// are those of its smoothed windows; across the plane they are small against the voxel's, so that Eq. 4 becomes the
// distance along the voxel's normal over its thickness.
#pragma once

#include <limits>
#include <span>

#include "core/map/voxel_map.hpp"
#include "core/registration/normal_equations.hpp"
#include "core/registration/placed_points.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct ScanToSubmapConfig {
    int iterations = 8;
    double gate_m = 0.5;
    double kernel_m = 0.08;
    double min_normal_cosine = 0.6;
    double residual_cap_m = 1.0;

    template <class V>
    void visit(V& v) {
        v.parameter("iterations", iterations, Range{1, 50}, "", "at most this many; it stops at 1 mm and 1e-4 rad");
        v.parameter("gate_m", gate_m, Range{0.05, 5.0}, "m",
                    "points farther from their voxel's plane have no counterpart");
        v.parameter("kernel_m", kernel_m, Range{0.005, 1.0}, "m",
                    "distance at which a point's weight has fallen to a quarter");
        v.parameter("min_normal_cosine", min_normal_cosine, Range{0.0, 1.0}, "",
                    "least cosine between the normals of point and voxel");
        v.parameter("residual_cap_m", residual_cap_m, Range{0.1, 10.0}, "m",
                    "residual of points with nothing of the submap near them");
    }
};

class ScanToSubmap {
  public:
    explicit ScanToSubmap(const ScanToSubmapConfig& config) : config_(config) {}

    /// Finds each flat point's plane.
    /// @param placed the same points in the local frame: the world moved to the lower corner of voxel `origin`
    /// @param excluded by point, 1: weighs nothing; points beyond its end take no part
    /// @param widening factor on gate and kernel: above 1 while the guess is poor
    /// @param deviation_m standard deviation of the guess's position, where it is known: the kernel need not be wider
    void match(const PointSelection& points, std::span<const std::uint8_t> excluded, const PlacedPoints& placed,
               VoxelMap& map, VoxelIndex origin, double widening, PlaneMatches& matches,
               double deviation_m = std::numeric_limits<double>::infinity()) const;

    /// Distances of the points to the nearest Gaussian of the submap around them: the residuals of the registration.
    /// @param ground by pixel, 1: is ground and left out; nullptr: nothing is
    void residuals(const PointSelection& points, const PlacedPoints& placed, VoxelMap& map, VoxelIndex origin,
                   AlignedVector<PixelIndex>& pixel, AlignedVector<float>& residual_m,
                   const Image<std::uint8_t>* ground = nullptr) const;

  private:
    ScanToSubmapConfig config_;
};

}  // namespace dlod
