// How the robot, and the sensor on it, moves.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "tools/sim/actor.hpp"
#include "tools/sim/arc_path.hpp"
#include "tools/sim/spline.hpp"

namespace dlod::tools::sim {

struct RobotOptions {
    double speed_mps = 1.0;
    double standing_s = 1.0;        ///< stands still at first; 0: it is in motion when the drive starts
    double sensor_height_m = 1.2;   ///< above the ground
    bool lap = false;               ///< stops where it began after one lap of a closed path: such drives can be joined
    bool wobble = true;             ///< a walking robot's pitch, roll and bob
    std::vector<double> kicks_s{};  ///< times at which it is kicked sideways, about 2 g
    std::vector<double> turns_s{};  ///< times at which it turns once about itself, 5 rad/s
};

/// Pose of the sensor over time, smooth enough for an IMU.
class RobotMotion {
  public:
    RobotMotion() = default;
    /// Follows the path with braking in bends and, if it is open, a stop at its end. The world is z up.
    RobotMotion(const ArcPath& path, const Terrain& terrain, const RobotOptions& options, double duration_s);

    Eigen::Isometry3d T_world_sensor(double t) const;
    /// Over the ground.
    Vec2 position(double t) const { return channels_(t).head<2>(); }
    Vec2 velocity(double t) const { return channels_.derivative(t).head<2>(); }

  private:
    Spline<6> channels_;  ///< x, y, z, roll, pitch, yaw
};

}  // namespace dlod::tools::sim
