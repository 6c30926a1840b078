// The residual image of the scan-to-submap registration and its average over a segment (paper, Sec. "Scan-Matching
// Residual-based Classification", Algorithm 1).
#pragma once

#include <span>

#include "core/types/frame.hpp"

namespace dlod {

/// R_ICP: at each pixel that took part in the registration the distance to its counterpart, elsewhere 0. Residuals
/// arrive with their pixel index; nothing is re-projected.
class ResidualImage {
  public:
    explicit ResidualImage(const SensorModel& sensor) : image_(sensor.height, sensor.width) {
        filled_.reserve(sensor.pixels());
    }
    void update(const OdometryResult& odometry);
    const Image<float>& image() const { return image_; }

  private:
    Image<float> image_;
    std::vector<PixelIndex> filled_;  ///< where it is not 0
};

struct AverageResidual {
    double mean_m = 0.0;  ///< 0 where no pixel had a residual
    int count = 0;
};

/// Algorithm 1: the mean of the non-zero residuals over the pixels of a segment. A segment of which hardly a point has
/// anything of the submap near it stands where the submap ends: none of its points has a residual, as none would have a
/// counterpart within the gate of a registration by nearest neighbours.
/// @param cap_m residual of points with nothing near them; infinity: their residuals count as well
AverageResidual average_residual(std::span<const PixelIndex> segment, const Image<float>& residual_image, float cap_m);

}  // namespace dlod
