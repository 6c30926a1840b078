// Frames of objects with known truth for tests of tracking, removal and map: no driver, no segmentation.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types/frame.hpp"

namespace dlod::test {

/// A sensor of 32 x 256 pixels whose beams are spread evenly over the sphere's middle.
SensorModel small_sensor();

/// An upright cylinder of which the side towards the sensor is seen.
struct Cylinder {
    Eigen::Vector3d foot_m = Eigen::Vector3d::Zero();  ///< world frame, at the stamp
    double radius_m = 0.25;
    double height_m = 1.7;
    bool moving = true;  ///< its points lie where free space was seen before
    int points = 120;
};

/// Builds frames whose sensor stands at the world's origin, unless the pose is changed before objects are added.
class SyntheticFrame {
  public:
    explicit SyntheticFrame(const SensorModel& sensor) : frame(sensor) { frame.odometry.valid = true; }

    /// Empties the frame and moves on by one period.
    void next(double dt_s = 0.1);
    /// Takes pixels that are still free, gives them the cylinder's points; returns the pixels' indices.
    std::vector<PixelIndex> place(const Cylinder& cylinder);
    /// A detection of such pixels, a segment of its own, all of whose points were tested against free space.
    Detection& detect(const std::vector<PixelIndex>& pixels, bool moving);
    /// Both at once.
    Detection& add(const Cylinder& cylinder) { return detect(place(cylinder), cylinder.moving); }

    Frame frame;

  private:
    PixelIndex next_pixel_ = 0;
};

}  // namespace dlod::test
