// Where a point of the world is seen in a frame's image.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/types/frame.hpp"
#include "core/types/oriented_box.hpp"
#include "core/types/sensor_model.hpp"
#include "tools/eval/pose_series.hpp"

namespace dlod::tools {

/// Projects by angle (Eq. 1), with the beams' own elevations and offsets and with the sensor's pose at the moment when
/// the column that sees the point was fired: within a sweep the image is bent by the sensor's motion.
class ImageProjection {
  public:
    /// @param trajectory poses of the run around the frame, sorted by time
    ImageProjection(const SensorModel& sensor, const Frame& frame, const PoseSeries& trajectory);

    /// Column and row, as fractions; rows beyond the top or bottom beam are extrapolated.
    /// @param p           world frame, at the frame's stamp
    /// @param velocity    of the point
    cv::Point2d pixel_of(const Eigen::Vector3d& p, const Eigen::Vector3d& velocity) const;

    /// The twelve edges of a box, each a chain of pixels.
    std::vector<std::vector<cv::Point2d>> edges_of(const OrientedBox& box, const Eigen::Vector3d& velocity) const;

  private:
    struct Beam {
        double row, column, measurement;
    };
    Beam beam_of(const Eigen::Vector3d& in_sensor) const;

    const SensorModel& sensor_;
    const Frame& frame_;
    const PoseSeries& trajectory_;
    Eigen::Isometry3d T_lidar_sensor_;
};

}  // namespace dlod::tools
