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
    struct Correction {
        double position_m = 0.0, position_deviation_m = 1.0;
        double rotation_rad = 0.0, rotation_deviation_rad = 1.0;
        double velocity_mps = 0.0, velocity_deviation_mps = 1.0;
    };
    /// The position alone is beyond belief.
    static bool is_impossible_position(const Correction& correction);
    /// @return false: this is beyond belief, the IMU is faulty from now on
    bool see_correction(const Correction& correction);
    /// While the IMU is not in use: how far its turn over a frame is from the lidar's, and its mean force from what the
    /// change of the lidar's velocity and gravity ask for.
    void see_motion(const Eigen::Vector3d& turn_difference_rad, double force_difference_mps2);

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
