// Whether the sensor stands, told by the lidar alone.
#pragma once

#include <cstdint>
#include <vector>

#include "core/registration/normal_equations.hpp"
#include "core/types/frame.hpp"
#include "core/types/sensor_model.hpp"

namespace dlod {

/// A sensor that stands sees each surface in the same pixel and at the same range again. Surfaces are compared pixel by
/// pixel with those of the first scan since when it has been standing, not with the last one: however slowly it creeps
/// away, it is found out within millimetres. What moves in its view is a minority, and off by more than noise.
class Standstill {
  public:
    explicit Standstill(const SensorModel& sensor);

    /// Compares with this scan from now on.
    void begin(const PointSelection& points);
    /// @param slow the motion that is believed may be none: only such a sensor may have come to rest
    /// @return the sensor has not moved
    bool see(const PointSelection& points, bool slow);

  private:
    struct Surface {
        float position[3];
        float normal[3];
    };

    bool shows_no_motion(const PointSelection& points);

    bool standing_ = false;
    std::vector<Surface> surfaces_;        ///< of the scan that is compared with
    std::vector<PixelIndex> pixels_;       ///< of these
    std::vector<std::uint32_t> by_pixel_;  ///< [H * W] number of the surface from 1 on; 0: none
    PlaneMatches matches_;
    NormalEquations equations_;
};

}  // namespace dlod
