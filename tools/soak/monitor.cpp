#include "tools/soak/monitor.hpp"

#include <algorithm>
#include <utility>

namespace dlod::tools::soak {

Monitor::Monitor(const std::string& url, const std::string& prefix, const TruthPath& truth) : lcm_(url), truth_(truth) {
    if (!lcm_.good()) return;
    lcm_.subscribe(prefix + "POSE", &Monitor::on_pose, this);
    lcm_.subscribe(prefix + "STATUS", &Monitor::on_status, this);
    thread_ = std::thread([this] {
        while (!stopping_) lcm_.handleTimeout(100);
    });
}

Monitor::~Monitor() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
}

Observation Monitor::take() {
    const std::lock_guard lock(mutex_);
    Observation taken = std::exchange(observation_, {});
    observation_.last_status = taken.last_status;
    return taken;
}

void Monitor::on_pose(const lcm::ReceiveBuffer*, const std::string&, const pose_t* message) {
    const std::lock_guard lock(mutex_);
    ++observation_.poses;
    if ((message->flags & pose_t::VALID) == 0) {
        step_known_ = false;
        return;
    }
    ++observation_.valid;
    if ((message->flags & pose_t::PREDICTED_ONLY) != 0) ++observation_.predicted;
    const Eigen::Map<const Eigen::Vector3d> t(message->position);
    const auto* w = message->orientation;
    const Eigen::Isometry3d T_odom_sensor = Eigen::Translation3d(t) * Eigen::Quaterniond(w[0], w[1], w[2], w[3]);
    const Eigen::Isometry3d T_truth_sensor = truth_.at(message->utime);
    if (!T_truth_odom_) T_truth_odom_ = T_truth_sensor * T_odom_sensor.inverse();
    const double error_m = (*T_truth_odom_ * Eigen::Vector3d(t) - T_truth_sensor.translation()).norm();
    observation_.worst_error_m = std::max(observation_.worst_error_m, error_m);
    observation_.sum_squared_m2 += error_m * error_m;
    if (step_known_) {
        const double step_m = (t - last_odom_m_).norm() - (T_truth_sensor.translation() - last_truth_m_).norm();
        observation_.worst_step_m = std::max(observation_.worst_step_m, std::abs(step_m));
    }
    last_odom_m_ = t;
    last_truth_m_ = T_truth_sensor.translation();
    step_known_ = true;
}

void Monitor::on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* message) {
    const std::lock_guard lock(mutex_);
    ++observation_.statuses;
    observation_.last_status = *message;
}

}  // namespace dlod::tools::soak
