// The robot itself in its sensor's view.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/types/frame.hpp"

namespace dlod::driver {

/// A part of the robot: a box along the axes of the base frame, metres.
struct BodyBox {
    Eigen::Vector3d low_m;
    Eigen::Vector3d high_m;
};

/// Makes returns from the robot's own body no returns. It costs next to nothing where the sensor does not see the body:
/// only rows with a return as near as the body are looked at.
class BodyFilter {
  public:
    /// Removes nothing.
    BodyFilter() = default;
    BodyFilter(const Eigen::Isometry3d& T_base_sensor, const std::vector<BodyBox>& boxes);

    /// Call it after Geometry::process. Pixels whose point lies in a box give range 0, raw and in metres, and 0, 0, 0.
    void process(Frame& frame) const;

  private:
    float T_base_sensor_[12] = {};  ///< row-major 3 x 4
    struct Bounds {
        float low[3], high[3];
    };
    std::vector<Bounds> boxes_;
    float reach_m_ = 0.0F;  ///< farthest corner from the sensor
};

}  // namespace dlod::driver
