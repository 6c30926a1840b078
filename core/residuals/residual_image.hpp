// The residual image of the scan-to-submap registration and its average over a segment (paper, Sec. "Scan-Matching
// Residual-based Classification", Algorithm 1).
#pragma once

#include "core/types/frame.hpp"

#include <span>

namespace dlod {

/// R_ICP: at each pixel that took part in the registration the distance to its counterpart, elsewhere 0. Residuals
/// arrive with their pixel index; nothing is re-projected.
class ResidualImage {
  public:
    explicit ResidualImage(const SensorModel& sensor) : image_(sensor.height, sensor.width) {}
    void update(const OdometryResult& odometry);
    const Image<float>& image() const { return image_; }

  private:
    Image<float> image_;
};

struct AverageResidual {
    double mean_m = 0.0;  ///< 0 where no pixel had a residual
    int count = 0;
};

/// Algorithm 1: the mean of the non-zero residuals over the pixels of a segment.
AverageResidual average_residual(std::span<const PixelIndex> segment, const Image<float>& residual_image);

}  // namespace dlod
