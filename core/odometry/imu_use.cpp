#include "core/odometry/imu_use.hpp"

#include <algorithm>
#include <cmath>

#include "core/odometry/levelling.hpp"
#include "core/registration/observability.hpp"

namespace dlod {
namespace {

// A force below this has no direction.
constexpr double kNoForce_mps2 = 0.1;
// So many times what makes a direction observable has to face it before the lidar accuses the IMU of a wrong position.
constexpr double kAccusationDemand = 6.0;

/// Mean specific force over the frame, body; 0 where there is none.
Eigen::Vector3d specific_force(const Frame& frame) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int samples = 0;
    for (const ImuSample& sample : frame.imu) {
        if (!sample.acceleration_mps2.allFinite()) continue;
        sum += sample.acceleration_mps2.cast<double>();
        ++samples;
    }
    return sum / std::max(1, samples);
}

}  // namespace

void ImuUse::see_samples(const Frame& frame) {
    const int taken = enabled_ ? samples_.add(frame.imu) : 0;
    monitor_.see_samples(frame.imu, taken, samples_.newest_ns(), frame.header.stamp_ns);
}

void ImuUse::forget_before(const Frame& frame) {
    samples_.clear();
    samples_.add(frame.imu);
}

Eigen::Vector3d ImuUse::up(const Frame& frame) {
    const Eigen::Vector3d force = specific_force(frame);
    return force.norm() > kNoForce_mps2 ? Eigen::Vector3d(force.normalized()) : Eigen::Vector3d::UnitZ();
}

void ImuUse::initialize(MotionFilter& filter, const Eigen::Isometry3d& T_world_sensor,
                        const Eigen::Vector3d& gravity_mps2, std::int64_t stamp_ns) {
    filter.initialize(T_world_sensor, gravity_mps2, stamp_ns, usable() ? &samples_ : nullptr);
    gravity_known_ = gravity_known_ || usable();
}

void ImuUse::choose_model(MotionFilter& filter, const Frame& frame, const Eigen::Vector3d& rate_radps) {
    if (filter.uses_imu() && !monitor_.usable()) {
        drop(filter, rate_radps);
    } else if (!filter.uses_imu() && monitor_.usable() && !frame.imu.empty()) {
        filter.use_imu(&samples_);
        if (!gravity_known_) filter.set_gravity(-kStandardGravity_mps2 * (filter.state().rotation * up(frame)));
        gravity_known_ = true;
    }
}

void ImuUse::drop(MotionFilter& filter, const Eigen::Vector3d& rate_radps) {
    filter.use_imu(nullptr);
    filter.set_motion(filter.state().velocity_mps, rate_radps);
}

bool ImuUse::agrees(const MotionFilter& filter, const FrameRegistration& registration, const Matrix6d& from_scan,
                    bool level_known) {
    const MotionFilter::Vector correction = filter.correction();
    const MotionFilter::Vector deviation = filter.prior_deviation();
    const Vector6d left = from_scan * registration.equations().b[0];
    const double clock_m = ImuBuffer::kClockOffset_s * filter.state().velocity_mps.norm();
    const double position_m2 =
        deviation.head<3>().squaredNorm() + from_scan.topLeftCorner<3, 3>().trace() + clock_m * clock_m;
    ImuMonitor::Correction seen{.position_m = level_known ? (correction.head<3>() - left.head<3>()).norm() : 0.0,
                                .position_deviation_m = std::sqrt(position_m2),
                                .rotation_rad = correction.segment<3>(3).norm(),
                                .rotation_deviation_rad = deviation.segment<3>(3).norm(),
                                .velocity_mps = correction.segment<3>(6).norm(),
                                .velocity_deviation_mps = deviation.segment<3>(6).norm()};
    if (ImuMonitor::is_impossible_position(seen)) {
        // In a tunnel a van may be all that faces along it.
        const auto demanding = Observability::of(registration.matches(), registration.equations(), kAccusationDemand);
        if (demanding.unobservable() > 0) seen.position_m = 0.0;
    }
    return monitor_.see_correction(seen);
}

void ImuUse::see_motion(const RegisteredMotion::Change& change, const MotionFilter& filter, const Frame& frame) {
    if (samples_.empty()) return;
    const MotionState& state = filter.state();
    const Eigen::Vector3d free_mps2 = change.velocity_mps / change.duration_s - state.gravity_mps2;
    const Eigen::Vector3d force_mps2 = state.rotation * specific_force(frame);
    monitor_.see_motion(samples_.turn(change.from_ns, filter.stamp_ns()) - change.turn_rad,
                        gravity_known_ ? (force_mps2 - free_mps2).norm() : force_mps2.norm() - free_mps2.norm());
}

}  // namespace dlod
