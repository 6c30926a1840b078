// Feasibility rules: which segments of the range image may be objects (paper, Sec. "Range Image-based Segmentation";
// the reference's size rules).
#pragma once

#include "core/types/parameter.hpp"
#include "core/types/track.hpp"

namespace dlod {

struct FeasibilityConfig {
    int min_points = 10;
    int min_rows = 2;
    double min_height_m = 0.2;
    double max_height_m = 4.0;
    double max_length_m = 14.0;
    double max_lowest_point_m = 1.5;
    double max_range_m = 50.0;
    double max_side_ratio = 10.0;

    template <class V>
    void visit(V& v) {
        v.parameter("min_points", min_points, Range{1, 10000}, "pixels",
                    "smaller segments are no objects; lower finds farther ones");
        v.parameter("min_rows", min_rows, Range{1, 128}, "rows", "segments that touch fewer image rows are no objects");
        v.parameter("min_height_m", min_height_m, Range{0.0, 10.0}, "m", "flatter segments are no objects");
        v.parameter("max_height_m", max_height_m, Range{0.1, 20.0}, "m", "taller segments are no objects");
        v.parameter("max_length_m", max_length_m, Range{0.1, 100.0}, "m",
                    "segments longer than this, horizontally, are no objects");
        v.parameter("max_lowest_point_m", max_lowest_point_m, Range{-10.0, 20.0}, "m",
                    "segments that hang higher above the sensor are no objects");
        v.parameter("max_range_m", max_range_m, Range{1.0, 300.0}, "m", "segments that reach farther are no objects");
        v.parameter("max_side_ratio", max_side_ratio, Range{1.0, 1000.0}, "1",
                    "greatest ratio of the longest to the second longest side");
    }
};

/// True where what is seen of a segment is more than the rules allow: the rest of it will not change that.
bool is_too_large(float height_m, float length_m, float max_range_m, const FeasibilityConfig& config);

/// True where the segment passes every rule. Uses count, rows, bounds and max_range_m.
bool is_feasible(const Segment& segment, const FeasibilityConfig& config);

}  // namespace dlod
