// Covariance of the pose in the world.
#pragma once

#include <Eigen/Core>

#include "core/map/keyframe_database.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/registration/normal_equations.hpp"
#include "core/registration/observability.hpp"

namespace dlod {

/// How uncertain a pose is comes of the submap that it rests on, of the registration with it, and of what is held or
/// predicted. The filter's own uncertainty serves for the latter only: it is made for a steady pose, not for an honest
/// one. All covariances are of (translation, rotation), world axes.
class PoseUncertainty {
  public:
    using Directions = Observability::Directions;

    /// @param surface_error_m error of the map that all points of a voxel's surface share
    explicit PoseUncertainty(double surface_error_m) : surface_error_m_(surface_error_m) {}

    /// A map begins at this position, where the pose has this covariance.
    void begin_map(const Eigen::Vector3d& position_m, const Matrix6d& covariance);
    /// What the matches of a registration leave uncertain, where nothing is held: their own errors, and those of the
    /// map.
    void see_matches(const PlaneMatches& matches, const NormalEquations& equations, const Directions& held);
    /// After see_matches: what the filter has not followed of them, which without IMU it does no faster than a robot is
    /// taken to change its motion.
    /// @param last_step of the filter
    /// @param sweep_noise of the motion within the sweep
    void see_lag(const NormalEquations& equations, const Vector6d& last_step, const Matrix6d& sweep_noise,
                 const Directions& held);
    /// With the IMU the filter follows at once.
    void see_no_lag() { lag_.setZero(); }

    /// Of the last registration, the map being right.
    const Matrix6d& from_scan() const { return from_scan_; }
    /// Of what the pose is relative to.
    const Matrix6d& anchor() const { return anchor_; }

    /// A registered pose takes the place of the map there for what it is relative to. Along what is held that is still
    /// the one that was left behind: what has happened since then is in the filter's own uncertainty.
    void see_map(const KeyframeDatabase& map, const Eigen::Vector3d& position_m, const Directions& held);
    /// Of a registered pose.
    /// @param newness share of what is seen there that is not in the map yet
    /// @param predicted the filter's covariance
    Matrix6d of_registered(double newness, const Matrix6d& predicted, const Directions& held) const;
    /// Of a predicted pose, and of the one that a map begins with.
    Matrix6d of_predicted(const Matrix6d& predicted) const { return anchor_ + predicted; }

  private:
    double surface_error_m_;
    SurfaceInformation surface_information_;
    Matrix6d from_scan_ = Matrix6d::Zero();
    Matrix6d lag_ = Matrix6d::Zero();       ///< mean square of what the filter has not followed of late
    Matrix6d from_map_ = Matrix6d::Zero();  ///< what the map's errors add where it is seen from elsewhere
    Matrix6d anchor_ = Matrix6d::Zero();
    Matrix6d start_ = Matrix6d::Zero();  ///< of the pose that the map began with
    Eigen::Vector3d start_position_m_ = Eigen::Vector3d::Zero();
};

}  // namespace dlod
