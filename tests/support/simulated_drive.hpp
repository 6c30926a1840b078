// A small drive simulator for tests: a spinning lidar with IMU among boxes, the sweep distorted by its motion.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "core/types/frame.hpp"

namespace dlod::test {

/// A box; `inside` turns it inside out: a room. Velocity moves it.
struct SceneBox {
    Eigen::Vector3d low, high;
    bool inside = false;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

/// Pose of the sensor in the world at a time in seconds.
using Trajectory = std::function<Eigen::Isometry3d(double)>;

/// Time on the way of a robot that stands for half a second and then takes another one to get up to speed.
inline double after_rest(double time_s) {
    const double u = std::max(0.0, time_s - 0.5);
    return u < 1.0 ? 0.5 * u * u : u - 0.5;
}

struct DriveOptions {
    int height = 32;
    int width = 512;
    double period_s = 0.1;
    double range_noise_m = 0.01;
    double gyro_noise_radps = 0.003;
    double accelerometer_noise_mps2 = 0.03;
    Eigen::Vector3d gyro_bias_radps = {0.002, -0.001, 0.0015};
    Eigen::Vector3d accelerometer_bias_mps2 = {0.02, -0.015, 0.01};
    bool imu = true;
    std::uint64_t seed = 1;
    double max_range_m = 90.0;
};

/// A room of 20 x 16 x 5 m with pillars, crates and a side room.
std::vector<SceneBox> furnished_room();

class SimulatedDrive {
  public:
    SimulatedDrive(std::vector<SceneBox> scene, Trajectory trajectory, const DriveOptions& options = {});

    const SensorModel& sensor() const { return sensor_; }
    /// Fills header, raw ranges, columns, IMU samples and cloud of frame k, which begins at k periods.
    void fill(int k, Frame& frame);
    Eigen::Isometry3d pose(double time_s) const { return trajectory_(time_s); }
    /// True where the last frame's pixel shows something that moves.
    bool is_moving(PixelIndex pixel) const { return moving_[pixel] != 0; }
    /// Time of a frame's stamp in seconds.
    double stamp_s(int k) const;

    /// Time at which the last frame's stamp was taken, seconds, whatever spoil_frame has made of it.
    double last_stamp_s() const { return last_stamp_s_; }

    /// Changes a frame after it has been filled.
    std::function<void(int frame, Frame&)> spoil_frame;
    /// Changes each IMU sample before it goes into a frame.
    std::function<void(ImuSample&)> spoil_imu;
    /// False: the column is lost.
    std::function<bool(int frame, int measurement)> column_arrives;

    static constexpr std::int64_t kEpoch_ns = 1'000'000'000'000;

  private:
    struct Hit {
        double distance = 0.0;  ///< 0: none
        bool moving = false;
    };
    Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double time_s) const;
    ImuSample imu_at(double time_s);

    std::vector<SceneBox> scene_;
    Trajectory trajectory_;
    DriveOptions options_;
    SensorModel sensor_;
    Image<std::uint8_t> moving_;
    std::mt19937_64 random_;
    std::normal_distribution<double> normal_;
    double next_imu_s_ = 0.003;
    double last_stamp_s_ = 0.0;
};

}  // namespace dlod::test
