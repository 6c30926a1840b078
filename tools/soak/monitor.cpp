#include "tools/soak/monitor.hpp"

#include <utility>

#include "core/types/lie.hpp"

namespace dlod::tools::soak {

Monitor::Monitor(const std::string& url, const std::string& prefix) : lcm_(url) {
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
    if ((message->flags & pose_t::VALID) == 0) return;
    if ((message->flags & pose_t::PREDICTED_ONLY) != 0) ++observation_.predicted;
    const auto* w = message->orientation;
    observation_.valid.push_back(
        {1e-6 * static_cast<double>(message->utime),
         make_pose(Eigen::Quaterniond(w[0], w[1], w[2], w[3]), Eigen::Vector3d::Map(message->position))});
}

void Monitor::on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* message) {
    const std::lock_guard lock(mutex_);
    ++observation_.statuses;
    observation_.last_status = *message;
}

}  // namespace dlod::tools::soak
