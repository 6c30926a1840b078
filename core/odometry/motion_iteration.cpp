#include "core/odometry/motion_iteration.hpp"

#include <algorithm>

namespace dlod {
namespace {

constexpr double kNoChange = 1e-9;

}  // namespace

Vector6d MotionIteration::next(const Vector6d& motion, const Vector6d& change) {
    const Vector6d turn = change - change_;
    const double taken_back =
        first_ ? 0.0 : std::clamp(change.dot(turn) / std::max(kNoChange, turn.squaredNorm()), 0.0, 1.0);
    const Vector6d next = motion + change - taken_back * (motion - motion_ + turn);
    motion_ = motion;
    change_ = change;
    first_ = false;
    return next;
}

}  // namespace dlod
