// Rotations and rigid transforms: exponential and logarithm, kept orthonormal.
#pragma once

#include <Eigen/Geometry>

namespace dlod {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Skew-symmetric matrix: skew(a) * b = a x b.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
    Eigen::Matrix3d m;
    m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return m;
}

/// Rotation by the vector's length [rad] about its direction.
inline Eigen::Quaterniond so3_exp(const Eigen::Vector3d& omega) {
    const double angle = omega.norm();
    if (angle < 1e-9) return Eigen::Quaterniond(1.0, 0.5 * omega.x(), 0.5 * omega.y(), 0.5 * omega.z()).normalized();
    const double s = std::sin(0.5 * angle) / angle;
    return Eigen::Quaterniond(std::cos(0.5 * angle), s * omega.x(), s * omega.y(), s * omega.z());
}

/// Rotation vector [rad] of a unit quaternion, of length at most pi.
inline Eigen::Vector3d so3_log(Eigen::Quaterniond q) {
    if (q.w() < 0.0) q.coeffs() *= -1.0;
    const double n = q.vec().norm();
    if (n < 1e-12) return 2.0 * q.vec();
    return 2.0 * std::atan2(n, q.w()) / n * q.vec();
}

inline Eigen::Isometry3d make_pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = rotation.normalized().toRotationMatrix();
    T.translation() = translation;
    return T;
}

/// The nearest proper rigid transform: call it after every product that is kept, drift of the rotation is a known trap.
inline Eigen::Isometry3d orthonormalized(const Eigen::Isometry3d& T) {
    return make_pose(Eigen::Quaterniond(T.linear()), T.translation());
}

}  // namespace dlod
