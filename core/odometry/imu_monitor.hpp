// Whether the IMU is to be believed.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>

#include "core/odometry/imu_buffer.hpp"
#include "core/types/imu_sample.hpp"

namespace dlod {

/// Watches the samples (silent, on another clock, stuck, spikes, no numbers) and how they agree with the lidar (wrong
/// axes, wrong scale). A fault takes effect at once; the IMU is taken back after it has behaved for a while, twice as
/// long each time.
class ImuMonitor {
  public:
    /// The samples that came with a frame.
    /// @param taken how many of them the buffer accepted
    void see_samples(std::span<const ImuSample> samples, int taken, std::int64_t newest_ns, std::int64_t stamp_ns);
    /// How far the lidar's solution was from the prediction by the IMU, and how far the prediction thought it might be.
    /// @return false: this is beyond belief, the IMU is faulty from now on
    bool see_correction(const Eigen::Vector3d& rotation_rad, double rotation_deviation_rad,
                        const Eigen::Vector3d& velocity_mps, double velocity_deviation_mps);
    /// While the IMU is not in use: the turn over a frame after the gyroscope and after the lidar.
    void see_turns(const Eigen::Vector3d& gyro_rad, const Eigen::Vector3d& lidar_rad);

    /// The lidar made sense only without the IMU: it is faulty from now on.
    void blame() { fail(); }

    bool usable() const { return present_ && !faulty_; }
    bool faulty() const { return faulty_; }
    /// The last frame's samples show no motion: neither turn nor shock nor vibration.
    bool quiet() const { return quiet_frames_ > 0; }

  private:
    void fail();
    void see_rest(std::span<const ImuSample> samples);

    bool present_ = false;  ///< there has been a sample, ever
    bool faulty_ = false;
    int quiet_frames_ = 0;                                       ///< in a row
    Eigen::Vector3f rest_force_mps2_ = Eigen::Vector3f::Zero();  ///< mean over them
    bool clean_ = true;                                          ///< nothing wrong with the last frame's samples
    int clean_frames_ = 0;
    int wait_frames_ = 10;       ///< doubled by each fault
    double disagreement_ = 0.0;  ///< of lidar and IMU, a leaky sum
};

}  // namespace dlod
