// Coarse ground removal on the range image (paper, Sec. "Range Image-based Segmentation", after LeGO-LOAM).
#pragma once

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct GroundRemovalConfig {
    double max_slope_rad = 0.1745;

    template <class V>
    void visit(V& v) {
        v.parameter("max_slope_rad", max_slope_rad, Range{0.01, 0.8}, "rad", "steepest slope between vertical neighbours that still counts as ground");
    }
};

/// Fills frame.prepared.ground from frame.cloud. Needs no pose.
class GroundRemoval {
  public:
    GroundRemoval(const SensorModel& sensor, const GroundRemovalConfig& config) : sensor_(sensor), config_(config) {}
    void process(Frame& frame);

  private:
    SensorModel sensor_;
    GroundRemovalConfig config_;
};

}  // namespace dlod
