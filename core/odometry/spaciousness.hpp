// How far the surroundings are.
#pragma once

#include <vector>

#include "core/types/frame.hpp"

namespace dlod {

/// Median range of the selected points, smoothed over the frames (Chen et al., DLO).
class Spaciousness {
  public:
    /// @return of this scan and those before it, m
    double see(const PointSelection& points);

  private:
    double median_m_ = 0.0;
    std::vector<float> ranges_;  ///< scratch: squared
};

}  // namespace dlod
