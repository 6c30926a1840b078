// What the last two registered scans say of the motion between them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "core/odometry/motion_filter.hpp"

namespace dlod {

class RegisteredMotion {
  public:
    /// From one registered scan to the next.
    struct Change {
        std::int64_t from_ns = 0;
        double duration_s = 0.0;
        Eigen::Vector3d turn_rad;      ///< of the body, its axes
        Eigen::Vector3d velocity_mps;  ///< by how much it has changed, world
    };

    /// Another scan has been registered.
    /// @return nothing where there was none shortly before
    std::optional<Change> see_scan(const MotionState& state, std::int64_t stamp_ns);
    /// The world turns.
    void turn_world(const Eigen::Matrix3d& R_new_old);

    /// Of the last registered scan.
    std::int64_t stamp_ns() const { return stamp_ns_; }
    double since_s(std::int64_t stamp_ns) const { return static_cast<double>(stamp_ns - stamp_ns_) * 1e-9; }
    /// Mean angular velocity between the last two scans, body.
    const Eigen::Vector3d& rate_radps() const { return rate_radps_; }

  private:
    std::int64_t stamp_ns_ = 0;
    Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
    Eigen::Vector3d velocity_mps_ = Eigen::Vector3d::Zero();
    Eigen::Vector3d rate_radps_ = Eigen::Vector3d::Zero();
};

}  // namespace dlod
