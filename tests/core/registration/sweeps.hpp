// Motions of the sensor over one frame for tests.
#pragma once

#include "core/registration/sweep_motion.hpp"
#include "core/types/lie.hpp"

namespace dlod::test {

/// 2 m/s and 5 rad/s; T_local_sensor at a time relative to the stamp.
inline Eigen::Isometry3d fast_and_turning(double t) {
    return make_pose(so3_exp(Eigen::Vector3d(0.3, -0.2, 0.5) + t * Eigen::Vector3d(1.0, -2.0, 4.5)),
                     Eigen::Vector3d(0.1, 0.2, 0.3) + t * Eigen::Vector3d(1.6, -1.2, 0.3));
}

/// Knots on a motion given by its pose at each time.
template <class PoseAt>
SweepMotion sweep_of(PoseAt&& pose_at, double duration_s) {
    SweepMotion motion;
    motion.duration_s = static_cast<float>(duration_s);
    for (int k = 0; k < SweepMotion::kKnots; ++k) {
        const Eigen::Isometry3d T = pose_at(duration_s * k / (SweepMotion::kKnots - 1) - duration_s);
        for (int i = 0; i < 12; ++i) motion.rows[k][i] = static_cast<float>(T.matrix()(i / 4, i % 4));
    }
    return motion;
}

/// A sensor that stays where it is.
inline SweepMotion at_rest(const Eigen::Isometry3d& T_local_sensor) {
    return sweep_of([&](double) { return T_local_sensor; }, 0.1);
}

/// The pose between the knots, one number after the other, in double precision.
inline Eigen::Isometry3d interpolated(const SweepMotion& motion, double time_s) {
    const double duration_s = static_cast<double>(motion.duration_s);
    const double place = (time_s / duration_s + 1.0) * (SweepMotion::kKnots - 1);
    const int k = std::clamp(static_cast<int>(std::floor(place)), 0, SweepMotion::kKnots - 2);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (int i = 0; i < 12; ++i) {
        const double a = static_cast<double>(motion.rows[k][i]), b = static_cast<double>(motion.rows[k + 1][i]);
        T.matrix()(i / 4, i % 4) = a + (place - k) * (b - a);
    }
    return T;
}

}  // namespace dlod::test
