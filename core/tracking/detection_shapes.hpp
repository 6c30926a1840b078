// The shapes of one frame's detections: their points in world axes, boxes and principal axes.
#pragma once

#include <vector>

#include "core/tracking/bounding_box.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Shape of a detection, beside what Detection itself holds.
struct DetectionShape {
    PrincipalAxis axis;
    double age_s = 0.0;  ///< mean time from the firing of its pixels to the frame's stamp
};

/// Keeps its memory from frame to frame.
class DetectionShapes {
  public:
    explicit DetectionShapes(const SensorModel& sensor) : sensor_(sensor) {}

    /// Takes the points of all detections of a frame and fills box, centroid and height of each.
    void compute(Frame& frame);
    /// The same for one detection whose pixels have changed their order; `index` may be one past the last.
    void recompute(Frame& frame, std::size_t index);

    const DetectionShape& operator[](std::size_t detection) const { return shapes_[detection]; }
    /// Points of a detection, in the order of its pixels.
    PointSpan points(const Detection& detection) const { return points_of(points_, detection.first, detection.count); }
    const Eigen::Vector3d& origin() const { return points_.origin_m; }
    LocalPoints& all_points() { return points_; }

  private:
    void describe(Frame& frame, std::size_t index);

    SensorModel sensor_;
    LocalPoints points_;
    std::vector<DetectionShape> shapes_;
};

}  // namespace dlod
