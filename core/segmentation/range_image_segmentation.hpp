// Clustering of the range image into segments (paper, Sec. "Range Image-based Segmentation", after Bogoslavskyi and
// Stachniss 2016).
//
// Two neighbours in the image belong together when the line between their points meets the longer beam at a large
// angle. Connected components over that relation are found from runs of pixels in a row and a union-find over the runs.
#pragma once

#include <cstdint>
#include <vector>

#include "core/segmentation/feasibility.hpp"
#include "core/segmentation/row_links.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct SegmentationConfig {
    double angle_threshold_rad = 0.2;
    double max_depth_step_m = 0.6;
    int min_points = 4;
    double min_range_m = 0.5;
    double max_range_m = 50.0;
    FeasibilityConfig feasibility;

    template <class V>
    void visit(V& v) {
        v.parameter("angle_threshold_rad", angle_threshold_rad, Range{0.01, 1.5}, "rad",
                    "neighbours whose connecting line meets the beam at a smaller angle are split; higher splits more");
        v.parameter("max_depth_step_m", max_depth_step_m, Range{0.05, 100.0}, "m",
                    "neighbours whose ranges differ by more are split whatever the angle");
        v.parameter("min_points", min_points, Range{1, 10000}, "pixels", "smaller segments are dropped as noise");
        v.parameter("min_range_m", min_range_m, Range{0.0, 10.0}, "m",
                    "nearer returns (the robot itself) are not segmented");
        v.parameter("max_range_m", max_range_m, Range{1.0, 300.0}, "m", "farther returns are not segmented");
        v.group("feasibility", feasibility, "which segments may be objects");
    }
};

/// Fills frame.prepared.segment, .segments and .pixels from frame.cloud and frame.prepared.ground. Segments are
/// numbered by their first pixel in row-major order. Needs no pose.
class RangeImageSegmentation {
  public:
    RangeImageSegmentation(const SensorModel& sensor, const SegmentationConfig& config);
    void process(Frame& frame);

  private:
    /// Of a segment.
    struct Bounds {
        Eigen::Array4f low = Eigen::Array4f::Constant(1e9F);             ///< x, y, z, range
        Eigen::Array4f high = Eigen::Array4f::Constant(-1e9F);           ///< likewise
        Eigen::Array4f high_diagonal = Eigen::Array4f::Constant(-1e9F);  ///< x + y, x - y and their negatives

        float length() const;
        float height() const { return high[2] - low[2]; }
    };

    /// A segment while its runs are collected.
    struct Growing {
        Bounds bounds;
        std::uint32_t next_pixel = 0;
        int last_row = -1;
        std::uint16_t rows = 0;
        bool too_large = false;  ///< no object, whatever follows: its bounds are not followed any more
    };

    /// Finds the runs and their union-find.
    void connect(const Frame& frame);
    /// Numbers the components that are large enough.
    void number_segments(Preparation& prepared);
    /// Fills the image, the pixel lists and the segments' properties.
    void collect(Preparation& prepared, const StructuredCloud& cloud);

    SensorModel sensor_;
    SegmentationConfig config_;
    float ratio_right_ = 0.0F;         ///< largest ratio of ranges of connected horizontal neighbours
    AlignedVector<float> ratio_down_;  ///< [H] likewise of row r - 1 and r
    RowLinks links_;
    // Runs of connected pixels of one row, in row-major order; arrays hold at most a run a pixel.
    std::vector<std::uint32_t> row_begin_;     ///< [H + 1] first run of each row
    std::vector<std::uint16_t> first_, last_;  ///< columns
    std::vector<std::uint32_t> parent_;        ///< in the union-find; the root is a component's first run
    std::vector<std::uint32_t> label_;         ///< 1 + index of the segment, 0 none
    std::vector<std::uint32_t> points_;        ///< of the component, by root run
    std::vector<Growing> growing_;             ///< by segment
};

}  // namespace dlod
