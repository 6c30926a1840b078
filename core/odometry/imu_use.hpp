// The IMU's part in the odometry.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/odometry/frame_registration.hpp"
#include "core/odometry/imu_buffer.hpp"
#include "core/odometry/imu_monitor.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/registered_motion.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// The filter goes by the IMU while it behaves, and by a constant velocity otherwise. Filters keep a pointer to the
/// samples in here.
class ImuUse {
  public:
    /// @param enabled false: whatever it says, the IMU takes no part
    explicit ImuUse(bool enabled) : enabled_(enabled) {}
    ImuUse(const ImuUse&) = delete;
    ImuUse& operator=(const ImuUse&) = delete;

    /// The samples that came with a frame.
    void see_samples(const Frame& frame);
    /// The clock has jumped: what came before this frame is of another time.
    void forget_before(const Frame& frame);

    const ImuBuffer& samples() const { return samples_; }
    bool usable() const { return monitor_.usable() && !samples_.empty(); }
    bool faulty() const { return monitor_.faulty(); }
    /// The last frame's samples show no motion.
    bool at_rest() const { return monitor_.quiet(); }
    /// Up, when at rest: direction of the mean specific force over the frame, body.
    static Eigen::Vector3d up(const Frame& frame);

    /// A filter begins at this pose, at rest as far as is known, with the IMU if it is usable.
    void initialize(MotionFilter& filter, const Eigen::Isometry3d& T_world_sensor, const Eigen::Vector3d& gravity_mps2,
                    std::int64_t stamp_ns);
    /// With the IMU if it behaves, without it otherwise.
    /// @param rate_radps of the body, after the lidar
    void choose_model(MotionFilter& filter, const Frame& frame, const Eigen::Vector3d& rate_radps);
    /// Goes on at a constant velocity.
    static void drop(MotionFilter& filter, const Eigen::Vector3d& rate_radps);

    /// Whether the filter's correction by the scan is one that the IMU may have left to do; else it is faulty from now
    /// on. Where the IMU is trusted more than the lidar, what the lidar would still change counts, too.
    /// @param from_scan covariance of the registration
    /// @param level_known false: an error of the level may have moved the prediction
    bool agrees(const MotionFilter& filter, const FrameRegistration& registration, const Matrix6d& from_scan,
                bool level_known);
    /// The lidar made sense only without the IMU: it is faulty from now on.
    void blame() { monitor_.blame(); }
    /// How the lidar has seen the robot move up to this frame: the IMU is judged by it while it is not in use.
    void see_motion(const RegisteredMotion::Change& change, const MotionFilter& filter, const Frame& frame);

  private:
    bool enabled_;
    bool gravity_known_ = false;  ///< the world is level, or the IMU has told how it is not
    ImuBuffer samples_;
    ImuMonitor monitor_;
};

}  // namespace dlod
