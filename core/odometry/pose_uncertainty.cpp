#include "core/odometry/pose_uncertainty.hpp"

#include <Eigen/Dense>

namespace dlod {
namespace {

constexpr double kLagSmoothing = 0.1;

/// Of what is not held.
Matrix6d free_of(const PoseUncertainty::Directions& held) {
    return Matrix6d::Identity() - held * held.transpose();
}

/// Inverse of the information where nothing is held.
Matrix6d inverse(const Matrix6d& information, const PoseUncertainty::Directions& held) {
    constexpr double kNothing = 1e-3;  // makes what is held invertible
    const Matrix6d free = free_of(held);
    const Matrix6d both = free * information * free + held * held.transpose() + kNothing * Matrix6d::Identity();
    return free * both.ldlt().solve(Matrix6d::Identity()) * free;
}

}  // namespace

void PoseUncertainty::begin_map(const Eigen::Vector3d& position_m, const Matrix6d& covariance) {
    start_position_m_ = position_m;
    start_ = covariance;
}

void PoseUncertainty::see_matches(const PlaneMatches& matches, const NormalEquations& equations,
                                  const Directions& held) {
    from_scan_ = inverse(equations.A[0], held);
    from_map_ = inverse(surface_information_.of(matches, surface_error_m_), held);
}

void PoseUncertainty::see_lag(const NormalEquations& equations, const Vector6d& last_step, const Matrix6d& sweep_noise,
                              const Directions& held) {
    const Matrix6d free = free_of(held);
    const Vector6d left = from_scan_ * (equations.b[0] + equations.A[0] * last_step);
    const Matrix6d now = left * left.transpose();
    lag_ += kLagSmoothing * (now - lag_);
    from_scan_ += now + lag_ + free * sweep_noise * free;
}

void PoseUncertainty::see_map(const KeyframeDatabase& map, const Eigen::Vector3d& position_m, const Directions& held) {
    const Matrix6d along = held * held.transpose();
    const Matrix6d free = free_of(held);
    Matrix6d submap;
    if (map.size() > 0) {
        submap = map.anchor_covariance(position_m);
    } else {
        Matrix6d J = Matrix6d::Identity();
        J.block<3, 3>(0, 3) = -skew(position_m - start_position_m_);
        submap = J * start_ * J.transpose();
    }
    anchor_ = (along * anchor_ * along + free * submap * free).eval();
}

Matrix6d PoseUncertainty::of_registered(double newness, const Matrix6d& predicted, const Directions& held) const {
    const Matrix6d along = held * held.transpose();
    return anchor_ + from_scan_ + newness * from_map_ + along * predicted * along;
}

}  // namespace dlod
