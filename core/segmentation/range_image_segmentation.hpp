// Clustering of the range image into segments (paper, Sec. "Range Image-based Segmentation", after Bogoslavskyi and
// Stachniss 2016), and the feasibility rules that say which segments may be objects.
#pragma once

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct SegmentationConfig {
    double angle_threshold_rad = 0.2;
    int min_points = 15;

    template <class V>
    void visit(V& v) {
        v.parameter("angle_threshold_rad", angle_threshold_rad, Range{0.01, 1.5}, "rad", "neighbours whose connecting line meets the beam at a smaller angle are split; higher splits more");
        v.parameter("min_points", min_points, Range{1, 10000}, "pixels", "smaller segments are no objects");
    }
};

/// Fills frame.prepared.segment, .segments and .pixels. Needs no pose.
class RangeImageSegmentation {
  public:
    RangeImageSegmentation(const SensorModel& sensor, const SegmentationConfig& config) : sensor_(sensor), config_(config) {}
    void process(Frame& frame);

  private:
    SensorModel sensor_;
    SegmentationConfig config_;
};

}  // namespace dlod
