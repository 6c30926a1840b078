// Clustering of the range image into segments (paper, Sec. "Range Image-based Segmentation", after Bogoslavskyi and
// Stachniss 2016).
//
// Two neighbours in the image belong together when the line between their points meets the longer beam at a large
// angle. Connected components over that relation are found from runs of pixels in a row and a union-find over the runs.
#pragma once

#include <cstdint>
#include <vector>

#include "core/segmentation/feasibility.hpp"
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
    /// Connected pixels of one row, columns [first, last].
    struct Run {
        std::uint32_t parent;   ///< in the union-find; the root is a component's first run
        std::uint32_t segment;  ///< of the root: 1 + index of the segment, 0 none
        std::uint16_t row, first, last;
    };

    /// Of a segment.
    struct Bounds {
        // Along x, y, z and the diagonals x + y, x - y (longer by the root of 2).
        float low[5] = {1e9F, 1e9F, 1e9F, 1e9F, 1e9F};
        float high[5] = {-1e9F, -1e9F, -1e9F, -1e9F, -1e9F};
        float range = 0.0F;
        void include(const StructuredCloud& cloud, std::size_t pixel);
        float length() const;
    };

    std::uint32_t find(std::uint32_t run);
    void unite(std::uint32_t a, std::uint32_t b);
    void connect(const Frame& frame);
    void find_runs(int row);
    /// Unites the runs of a row, [here, end), with those of the row above, [above, here).
    void unite_rows(std::uint32_t above, std::uint32_t here, std::uint32_t end);
    void collect(Preparation& prepared, const StructuredCloud& cloud);

    SensorModel sensor_;
    SegmentationConfig config_;
    float ratio_right_ = 0.0F;           ///< largest ratio of ranges of connected horizontal neighbours
    AlignedVector<float> ratio_down_;    ///< [H - 1] likewise of row r and r + 1
    Image<float> range_;                 ///< of the pixels that are segmented, 0 elsewhere
    AlignedVector<std::uint8_t> used_;   ///< [W] 1: the pixel is segmented
    AlignedVector<std::uint8_t> right_;  ///< [W] 1: connected to the right neighbour (wrapped)
    AlignedVector<std::uint8_t> down_;   ///< [W] 1: the pixel above is connected to this one
    std::vector<Run> runs_;
    std::vector<std::uint32_t> points_;      ///< of the component, by root run
    std::vector<std::uint32_t> next_pixel_;  ///< by segment
    std::vector<Bounds> bounds_;             ///< by segment
    std::vector<std::uint32_t> last_row_;    ///< by segment
};

}  // namespace dlod
