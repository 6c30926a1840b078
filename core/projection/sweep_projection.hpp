// Where a place in the world appears in a frame's image while the sensor moves during the sweep.
#pragma once

#include <array>
#include <optional>

#include "core/projection/range_image.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// The sensor's pose is taken per block of columns: 1.6 ms of motion at 10 Hz is nothing against a pixel.
class SweepProjection {
  public:
    explicit SweepProjection(const SensorModel& sensor);

    /// Takes over a frame's pose and motion (T_world_sensor and deskew).
    void set(const OdometryResult& odometry);

    struct Appearance {
        Pixel pixel;
        float range_m = 0.0F;  ///< from the sensor when the pixel was fired
    };
    /// The pixel that looked at a point of the world frame, to within one column; nothing outside of the image.
    std::optional<Appearance> project(const Eigen::Vector3d& world_m) const;

  private:
    static constexpr int kBlocks = 64;

    SensorModel sensor_;
    SensorProjection projection_;
    Eigen::Isometry3d T_sensor_world_ = Eigen::Isometry3d::Identity();
    std::array<Eigen::Isometry3f, kBlocks> T_block_stamp_;  ///< by measurement
};

}  // namespace dlod
