#include "core/tracking/walked_way.hpp"

#include <algorithm>

#include "core/tracking/visible_shift.hpp"

namespace dlod {

namespace {

constexpr double kSmall_m = 1.2;    // people
constexpr double kLeast_m = 0.5;    // a shorter way may be noise
constexpr double kGap_s = 0.35;     // pieces of clutter are missed for longer
constexpr double kRenewed_s = 1.0;  // what is compared with is one to two of these old
constexpr double kAgreement = 0.4;  // of the way, from what the velocity predicts
constexpr double kOwn = 0.5;        // of the way, that the sensor's does not explain
constexpr int kSteadyFrames = 3;

}  // namespace

bool WalkedWay::steady(const WholeSight& now, const Eigen::Vector2d& velocity_mps) const {
    const double least_m = std::max({kLeast_m, before_.visible.longest_m(), now.visible.longest_m()});
    if (visible_shift_m(before_.visible, now.visible) < least_m) return false;
    const Eigen::Vector2d way = (now.visible.center_m - before_.visible.center_m).head<2>();
    const double elapsed_s = now.time_s - before_.time_s;
    const Eigen::Vector2d sensors_way = now.sensor_m - before_.sensor_m;
    return (way - elapsed_s * velocity_mps).norm() < kAgreement * way.norm() &&
           (way - sensors_way).norm() > kOwn * way.norm();
}

bool WalkedWay::update(const WholeSight& now, bool whole, const Eigen::Vector2d& velocity_mps) {
    if (now.time_s - last_s_ > kGap_s) started_ = false;
    last_s_ = now.time_s;
    if (!whole || now.visible.longest_m() > std::min(kSmall_m, now.visible.size_m.z())) {
        steady_ = 0;
        return false;
    }
    if (!started_) {
        before_ = since_ = now;
        started_ = true;
        steady_ = 0;
        return false;
    }
    steady_ = steady(now, velocity_mps) ? steady_ + 1 : 0;
    if (now.time_s - since_.time_s > kRenewed_s) {
        before_ = since_;
        since_ = now;
    }
    return steady_ >= kSteadyFrames;
}

}  // namespace dlod
