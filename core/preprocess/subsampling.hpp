// Preprocessing: which pixels go to the registration, with their normals (paper, Sec. "Overview"; the reference's grid
// subsampling, crop box and minimum range).
#pragma once

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct SubsamplingConfig {
    int row_step = 2;
    int column_step = 5;
    double min_range_m = 0.5;

    template <class V>
    void visit(V& v) {
        v.parameter("row_step", row_step, Range{1, 16}, "rows", "every n-th row is a candidate; higher is faster, less accurate");
        v.parameter("column_step", column_step, Range{1, 64}, "columns", "every n-th column is a candidate");
        v.parameter("min_range_m", min_range_m, Range{0.0, 10.0}, "m", "nearer returns (the robot itself) are not used");
    }
};

/// Selects the points of the registration: fills frame.prepared.points from frame.cloud. Needs no pose.
class Subsampling {
  public:
    Subsampling(const SensorModel& sensor, const SubsamplingConfig& config) : sensor_(sensor), config_(config) {}
    void process(Frame& frame);

  private:
    SensorModel sensor_;
    SubsamplingConfig config_;
};

}  // namespace dlod
