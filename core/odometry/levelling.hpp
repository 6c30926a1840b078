// From when on a start in motion is to be trusted.
#pragma once

#include "core/odometry/imu_buffer.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/start_level.hpp"

namespace dlod {

/// The rotation that turns this direction of the sensor's frame upwards, and its x axis to yaw 0.
Eigen::Matrix3d levelled(const Eigen::Vector3d& up);

/// A robot that is in motion when it starts feels its acceleration beside gravity. Until the first scans show where
/// down is no pose is to be used, and with the first one that is the world begins.
class Levelling {
  public:
    /// What the accelerometer may feel beside gravity at such a start.
    static constexpr double kStartAcceleration_mps2 = 1.0;

    enum class Next {
        kWait,
        /// The scans before this one were deskewed for a motion that was not known yet.
        kRenewMap,
        /// The accelerometer does not feel the motion that the lidar sees: it may have taken a crowd for the world.
        kStartAgain,
        /// The level is known from now on: gravity().
        kBeginWorld,
    };

    /// The world begins in motion: where down is, is not known yet.
    void begin_in_motion() { known_ = false; }
    /// Where down is believed to be has to do.
    void give_up() { known_ = true; }
    bool known() const { return known_; }
    /// The map begins with this scan.
    void begin_map();
    /// Another scan has been registered while the level was not known.
    /// @param degenerate a direction is held: it follows the accelerometer, and says nothing of it
    Next see_scan(const MotionFilter& filter, const ImuBuffer& imu, bool degenerate);
    /// In the world so far.
    StartLevel::Gravity gravity() const { return start_level_.gravity().value(); }

  private:
    bool known_ = true;
    int scans_ = 0;    ///< registered since the map began
    int retries_ = 0;  ///< of the start, because it did not fit the accelerometer
    StartLevel start_level_;
};

}  // namespace dlod
