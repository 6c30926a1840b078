// Where down is, for a robot that is in motion when it starts.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/odometry/imu_buffer.hpp"
#include "core/odometry/motion_filter.hpp"

namespace dlod {

/// A robot that accelerates feels that beside gravity: its accelerometer alone does not tell where down is. The first
/// registered positions do: what they and the accelerometer, integrated twice, differ by is a velocity and gravity,
///     position(t) - integrated force(t) = p + v t + g t^2 / 2,
/// solved for by least squares.
class StartLevel {
  public:
    struct Gravity {
        Eigen::Vector3d mps2;   ///< world
        double deviation_mps2;  ///< each axis, if the positions are as good as they are taken to be
        double scatter;         ///< mean square of what the solution leaves of the positions, against that
    };

    StartLevel() { positions_.reserve(kMost); }
    void clear() { positions_.clear(); }
    /// The body at the stamp of the next registered scan.
    void add(const MotionState& state, std::int64_t stamp_ns, const ImuBuffer& imu);
    /// None before four positions.
    std::optional<Gravity> gravity() const;

  private:
    /// The last so many positions count.
    static constexpr std::size_t kMost = 8;
    struct Position {
        double time_s;
        Eigen::Vector3d unexplained_m;  ///< position less the integrated force
    };

    std::int64_t first_ns_ = 0;
    std::int64_t last_ns_ = 0;
    Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
    Eigen::Vector3d way_m_ = Eigen::Vector3d::Zero();  ///< of the integrated force, since the first position, world
    Eigen::Vector3d velocity_mps_ = Eigen::Vector3d::Zero();
    std::vector<Position> positions_;
};

}  // namespace dlod
