#include "core/odometry/motion_state.hpp"

#include "core/types/lie.hpp"

namespace dlod {

void advance(MotionState& state, const Eigen::Vector3d& rate_radps, const Eigen::Vector3d& acceleration_mps2,
             double dt_s) {
    state.rotation = (state.rotation * so3_exp(dt_s * rate_radps)).normalized();
    state.position_m += dt_s * state.velocity_mps + 0.5 * dt_s * dt_s * acceleration_mps2;
    state.velocity_mps += dt_s * acceleration_mps2;
}

void advance(MotionState& state, const ImuBuffer::Reading& middle, double dt_s) {
    const Eigen::Vector3d rate = middle.angular_velocity_radps - state.rate_radps;
    const Eigen::Quaterniond rotation = state.rotation * so3_exp(0.5 * dt_s * rate);
    const Eigen::Vector3d acceleration =
        rotation * (middle.acceleration_mps2 - state.accelerometer_bias_mps2) + state.gravity_mps2;
    advance(state, rate, acceleration, dt_s);
}

}  // namespace dlod
