// From ranges to points in the sensor frame.
#pragma once

#include <vector>

#include "core/types/frame.hpp"
#include "core/types/sensor_model.hpp"

namespace dlod::driver {

/// The sensor's beams as a lookup table, made once. By the angle addition theorems it factors into constants of a row
/// and of a column, so that it stays in the first-level cache: with theta = 2 pi (1 - m / W), a = -azimuth offset, p =
/// altitude, n = beam origin, range r and rho = r - n,
///     u = rho cos a cos p + n,  v = rho sin a cos p,  w = rho sin p,
///     lidar = (u cos theta - v sin theta, u sin theta + v cos theta, w),  sensor = T_sensor_lidar lidar.
class Geometry {
  public:
    explicit Geometry(const SensorModel& sensor);

    /// Fills frame.cloud from frame.raw.range_mm. Pixels without a return give 0, 0, 0 and range 0.
    void process(Frame& frame) const;

  private:
    struct Row {
        float forward;  ///< cos a cos p
        float left;     ///< sin a cos p
        float up;       ///< sin p
        int shift;      ///< in 0 .. W - 1: column = (measurement + shift) mod W
    };
    int width_;
    float beam_origin_m_;
    float beam_origin_height_m_;
    float T_sensor_lidar_[12];  ///< row-major 3 x 4
    std::vector<Row> rows_;
    AlignedVector<float> cos_theta_;  ///< [W] by measurement
    AlignedVector<float> sin_theta_;
};

}  // namespace dlod::driver
