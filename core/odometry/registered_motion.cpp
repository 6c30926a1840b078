#include "core/odometry/registered_motion.hpp"

namespace dlod {
namespace {

// Scans farther apart say little of how the robot moves.
constexpr double kMaxDistance_s = 0.5;

}  // namespace

std::optional<RegisteredMotion::Change> RegisteredMotion::see_scan(const MotionState& state, std::int64_t stamp_ns) {
    const double duration_s = since_s(stamp_ns);
    const bool is_first = stamp_ns_ == 0;
    const Change change{stamp_ns_, duration_s, so3_log(rotation_.conjugate() * state.rotation),
                        state.velocity_mps - velocity_mps_};
    stamp_ns_ = stamp_ns;
    rotation_ = state.rotation;
    velocity_mps_ = state.velocity_mps;
    if (is_first || duration_s <= 0.0 || duration_s >= kMaxDistance_s) return std::nullopt;
    rate_radps_ = change.turn_rad / duration_s;
    return change;
}

void RegisteredMotion::turn_world(const Eigen::Matrix3d& R_new_old) {
    rotation_ = Eigen::Quaterniond(R_new_old) * rotation_;
}

}  // namespace dlod
