// Motion of the sensor as an iterated error-state Kalman filter.
//
// The body is the IMU (the sensor where there is none). With the IMU the state is pose, velocity, the two biases and
// gravity, and the IMU's readings carry it on; without, the angular velocity takes the place of the gyro's bias and
// stays constant but for white noise. The lidar measures the pose at the stamp and, as its points were fired over the
// whole sweep, velocity and angular velocity (or gyro bias) too: deskewing and pose come out of one solution.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "core/odometry/imu_buffer.hpp"
#include "core/odometry/motion_state.hpp"
#include "core/registration/normal_equations.hpp"
#include "core/registration/observability.hpp"
#include "core/registration/sweep_motion.hpp"
#include "core/types/frame.hpp"
#include "core/types/lie.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct MotionFilterConfig {
    double gyro_noise = 1e-3;
    double accelerometer_noise = 0.02;
    double gyro_bias_walk = 1e-4;
    double accelerometer_bias_walk = 2e-3;
    double acceleration = 1.0;
    double angular_acceleration = 1.0;
    double information_share = 0.05;
    double information_share_without_imu = 0.01;

    template <class V>
    void visit(V& v) {
        v.parameter("gyro_noise", gyro_noise, Range{1e-6, 1.0}, "rad/s/sqrt(Hz)",
                    "noise density of the gyroscope, vibration included");
        v.parameter("accelerometer_noise", accelerometer_noise, Range{1e-5, 10.0}, "m/s^2/sqrt(Hz)",
                    "noise density of the accelerometer, vibration included");
        v.parameter("gyro_bias_walk", gyro_bias_walk, Range{0.0, 1.0}, "rad/s^2/sqrt(Hz)",
                    "how fast the gyroscope's bias wanders");
        v.parameter("accelerometer_bias_walk", accelerometer_bias_walk, Range{0.0, 1.0}, "m/s^3/sqrt(Hz)",
                    "how fast the accelerometer's bias wanders");
        v.parameter("acceleration", acceleration, Range{0.01, 100.0}, "m/s^2/sqrt(Hz)",
                    "without IMU: white acceleration of the robot");
        v.parameter("angular_acceleration", angular_acceleration, Range{0.01, 100.0}, "rad/s^2/sqrt(Hz)",
                    "without IMU: white angular acceleration");
        v.parameter("information_share", information_share, Range{1e-4, 1.0}, "",
                    "share of the points whose errors are independent; lower trusts the lidar less");
        v.parameter("information_share_without_imu", information_share_without_imu, Range{1e-4, 1.0}, "",
                    "the same without IMU; lower takes the motion to be smoother");
    }
};

class MotionFilter {
  public:
    static constexpr int kStates =
        18;  ///< position, rotation (world, small angles), velocity, rate, accelerometer bias, gravity
    using Vector = Eigen::Matrix<double, kStates, 1>;
    using Matrix = Eigen::Matrix<double, kStates, kStates>;

    MotionFilter(const MotionFilterConfig& config, const Eigen::Isometry3d& T_body_sensor);

    /// Starts at a pose of the sensor, at rest as far as is known.
    /// @param imu nullptr: none
    void initialize(const Eigen::Isometry3d& T_world_sensor, const Eigen::Vector3d& gravity_mps2, std::int64_t stamp_ns,
                    const ImuBuffer* imu);
    /// Goes on with or without the IMU from the present pose and velocity.
    void use_imu(const ImuBuffer* imu);
    bool uses_imu() const { return imu_ != nullptr; }

    void predict(std::int64_t stamp_ns);
    /// The same for a body that has been seen not to move; without IMU.
    void stand(std::int64_t stamp_ns);

    /// The sweep that ends at the present state, in coordinates relative to `origin_m` (world).
    void sweep(double duration_s, const Eigen::Vector3d& origin_m, SweepMotion& motion) const;

    /// The update: begin, then any number of steps each linearised at the present state, then finish.
    void begin_update();
    /// @param held directions of (translation, rotation), world axes, along which the lidar says nothing: pose and
    /// velocity stay as predicted there, and so does their uncertainty
    /// @return how far the pose has been moved: translation, rotation
    Vector6d step(const NormalEquations& equations, const Observability::Directions& held);
    void finish_update();
    /// After an update: the velocity along this direction, world axes, is believed to be zero, as far as it can be.
    void observe_rest(const Eigen::Vector3d& direction);
    /// Back to the prediction.
    void discard_update() { state_ = prior_; }
    /// What the update has changed against the prediction, and the prediction's standard deviations.
    Vector correction() const;
    const Vector& prior_deviation() const { return prior_deviation_; }

    const MotionState& state() const { return state_; }
    /// Whatever is believed of the velocity counts no more.
    void forget_velocity();
    /// Replaces velocity and rate, with their uncertainty as it is.
    void set_motion(const Eigen::Vector3d& velocity_mps, const Eigen::Vector3d& rate_radps);
    /// Moves the state, not its uncertainty: an offset in the world and a turn about its z axis.
    void move(const Eigen::Vector3d& offset_m, double turn_rad);
    /// Gravity is as it is believed to be to within this standard deviation, each axis.
    void doubt_gravity(double deviation_mps2);
    /// The same motion, seen from a new world, in which the sensor is here now and gravity points downwards.
    /// @param gravity_deviation_mps2 standard deviation of that, each axis
    void begin_world(const Eigen::Isometry3d& T_world_sensor, double gravity_deviation_mps2);
    void set_gravity(const Eigen::Vector3d& gravity_mps2) { state_.gravity_mps2 = gravity_mps2; }
    /// What the IMU's readings carry the motion on with.
    ImuCorrection imu_correction() const;
    Eigen::Isometry3d T_world_sensor() const;
    Eigen::Vector3d sensor_linear_velocity() const;   ///< sensor frame
    Eigen::Vector3d sensor_angular_velocity() const;  ///< sensor frame
    /// Of the sensor's translation, then rotation, world axes.
    Matrix6d pose_covariance() const;
    /// Covariance of (translation, rotation), world axes, that comes of the motion within a sweep of this duration not
    /// being quite what the state says.
    Matrix6d sweep_noise(double duration_s) const;
    const Matrix& covariance() const { return covariance_; }
    double position_deviation_m() const;  ///< of the sensor
    std::int64_t stamp_ns() const { return stamp_ns_; }
    /// Time since it was initialized.
    double age_s() const { return static_cast<double>(stamp_ns_ - start_ns_) * 1e-9; }

  private:
    static Eigen::Vector3d lasting(const MotionState& s, const Eigen::Vector3d& rate_radps);
    void advance(MotionState& s, std::int64_t mid_ns, double dt) const;
    Eigen::Vector3d body_rate(const MotionState& s, std::int64_t time_ns) const;
    void see_motion();
    void grow_covariance(const MotionState& before, const Eigen::Vector3d& acceleration_world, double dt);
    void forget(int block, double deviation);
    static Vector difference(const MotionState& a, const MotionState& b);
    static void apply(MotionState& s, const Vector& error);

    MotionFilterConfig config_;
    Eigen::Isometry3d T_body_sensor_;
    const ImuBuffer* imu_ = nullptr;
    MotionState state_;
    MotionState prior_;
    Vector prior_deviation_ = Vector::Zero();
    Matrix covariance_ = Matrix::Identity();
    Matrix prior_information_ = Matrix::Identity();
    Matrix information_ = Matrix::Identity();
    Eigen::Matrix<double, kStates, Eigen::Dynamic, 0, kStates, 12> held_;  ///< of the last step: basis of what is held
    /// Without IMU: squared densities of the robot's acceleration and angular acceleration, as seen of late.
    double acceleration2_ = 0.0;
    double angular_acceleration2_ = 0.0;
    double silent_s_ = 0.0;  ///< so long the IMU has said nothing, at the present stamp
    std::int64_t start_ns_ = 0;
    std::int64_t updated_ns_ = 0;
    std::int64_t stamp_ns_ = 0;
};

}  // namespace dlod
