// The filter of one object (paper, Sec. "Tracking and Association"): constant velocity, ten states.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>

#include "core/tracking/tracking_config.hpp"
#include "core/types/oriented_box.hpp"

namespace dlod {

/// What one frame says about the box of a whole object.
struct BoxMeasurement {
    OrientedBox box;     ///< world frame; its yaw counts modulo pi: a box has no front
    double age_s = 0.0;  ///< the points were measured this long before the frame's stamp, at least 0
    /// Standard deviations; a large one stands for "not seen".
    Eigen::Matrix2d plane_covariance = Eigen::Matrix2d::Identity() * 0.01;  ///< of the centre in the ground plane, m^2
    double z_sd_m = 0.1;
    double yaw_sd_rad = 0.3;
    Eigen::Vector3d size_sd_m = Eigen::Vector3d::Constant(0.1);
};

/// State: x y z [m], yaw [rad], length width height [m], vx vy vz [m/s]; world frame, at the time of the last
/// predict().
class KalmanFilter {
  public:
    static constexpr int kStates = 10;
    using State = Eigen::Matrix<double, kStates, 1>;
    using Covariance = Eigen::Matrix<double, kStates, kStates>;

    /// At rest until measured otherwise.
    KalmanFilter(const BoxMeasurement& first, const KalmanConfig& config);

    /// Moves the state on by dt seconds, at least 0.
    void predict(double dt_s, const KalmanConfig& config);

    /// The covariance stays symmetric and positive definite.
    void update(const BoxMeasurement& measurement, const KalmanConfig& config);

    /// Takes in a velocity in the ground plane, measured apart from the box.
    void update_velocity(const Eigen::Vector2d& velocity_mps, const Eigen::Matrix2d& covariance);

    /// Turns the box's axes by the multiple of 90 degrees that brings the yaw nearest to the reference; an odd multiple
    /// swaps length and width. The footprint stays what it was.
    void align_axes(double reference_yaw_rad);

    /// The object is longer or wider than was known: moves the ends of the box outwards (negative: inwards), without
    /// any motion.
    void grow(double front_m, double back_m, double left_m, double right_m);

    /// Length and width are known no better than that.
    void doubt_size(double sd_m);

    /// Squared Mahalanobis distance in the ground plane of a position measured with the given covariance.
    double plane_distance2(const Eigen::Vector2d& position_m, double age_s, const Eigen::Matrix2d& covariance) const;

    OrientedBox box() const;
    Eigen::Vector3d velocity() const { return state_.segment<3>(kVx); }
    double speed() const { return state_.segment<2>(kVx).norm(); }  ///< in the ground plane
    /// Standard deviation of the position along the direction in the ground plane where it is largest, m.
    double position_sd() const;
    /// Standard deviation of the velocity along the direction in the ground plane where it is largest, m/s.
    double velocity_sd() const;
    /// Of position, then velocity.
    Eigen::Matrix<double, 6, 6> motion_covariance() const;
    const State& state() const { return state_; }
    const Covariance& covariance() const { return covariance_; }

  private:
    /// Which states a measured number is the sum of, and by which factors.
    using Row = std::array<std::pair<int, double>, 4>;
    void update_one(const Row& measures, double innovation, double variance);

    enum Index { kX, kY, kZ, kYaw, kLength, kWidth, kHeight, kVx, kVy, kVz };

    State state_;
    Covariance covariance_;
};

}  // namespace dlod
