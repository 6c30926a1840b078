// A planner's side of a live run: subscribes over LCM's multicast and keeps what comes.
#pragma once

#include <atomic>
#include <cstdint>
#include <dlod/dynamic_mask_t.hpp>
#include <dlod/pose_t.hpp>
#include <dlod/status_t.hpp>
#include <dlod/tracks_t.hpp>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace dlod::test {

/// Counts and keeps the messages of one service in a thread of its own. From any thread.
class LiveSubscriber {
  public:
    /// @param url a port of its own: LCM hears every multicast group on its port
    /// @param prefix of the channels
    LiveSubscriber(const std::string& url, const std::string& prefix) : lcm_(url) {
        if (!lcm_.good()) return;
        lcm_.subscribe(prefix + "POSE", &LiveSubscriber::on_pose, this)->setQueueCapacity(kQueue);
        lcm_.subscribe(prefix + "POSE_PREDICTED", &LiveSubscriber::on_predicted, this)->setQueueCapacity(kQueue);
        lcm_.subscribe(prefix + "MASK", &LiveSubscriber::on_mask, this)->setQueueCapacity(kQueue);
        lcm_.subscribe(prefix + "TRACKS", &LiveSubscriber::on_tracks, this)->setQueueCapacity(kQueue);
        lcm_.subscribe(prefix + "STATUS", &LiveSubscriber::on_status, this)->setQueueCapacity(kQueue);
        thread_ = std::thread([this] {
            while (!stop_) lcm_.handleTimeout(50);
        });
    }
    ~LiveSubscriber() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
    }
    LiveSubscriber(const LiveSubscriber&) = delete;
    LiveSubscriber& operator=(const LiveSubscriber&) = delete;

    bool good() const { return lcm_.good(); }

    /// In the order in which they came.
    std::vector<pose_t> poses() const { return copy(poses_); }
    std::vector<pose_t> predicted_poses() const { return copy(predicted_poses_); }
    std::vector<status_t> statuses() const { return copy(statuses_); }
    std::size_t pose_count() const {
        const std::lock_guard lock(mutex_);
        return poses_.size();
    }
    /// utime by sequence.
    std::map<std::int64_t, std::int64_t> masks() const { return copy(masks_); }
    std::map<std::int64_t, std::int64_t> tracks() const { return copy(tracks_); }

    /// Forgets what came so far.
    void clear() {
        const std::lock_guard lock(mutex_);
        poses_.clear();
        predicted_poses_.clear();
        masks_.clear();
        tracks_.clear();
        statuses_.clear();
    }
    /// Waits until `condition()` holds. @return false where it does not within the timeout
    template <class Condition>
    static bool wait_until(std::chrono::milliseconds timeout, const Condition& condition) {
        const auto deadline = std::chrono::steady_clock::now() + timeout;
        while (!condition()) {
            if (std::chrono::steady_clock::now() > deadline) return false;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return true;
    }

  private:
    static constexpr int kQueue = 1000;

    template <class T>
    T copy(const T& kept) const {
        const std::lock_guard lock(mutex_);
        return kept;
    }
    void on_pose(const lcm::ReceiveBuffer*, const std::string&, const pose_t* m) {
        const std::lock_guard lock(mutex_);
        poses_.push_back(*m);
    }
    void on_predicted(const lcm::ReceiveBuffer*, const std::string&, const pose_t* m) {
        const std::lock_guard lock(mutex_);
        predicted_poses_.push_back(*m);
    }
    void on_mask(const lcm::ReceiveBuffer*, const std::string&, const dynamic_mask_t* m) {
        const std::lock_guard lock(mutex_);
        masks_[m->sequence] = m->utime;
    }
    void on_tracks(const lcm::ReceiveBuffer*, const std::string&, const tracks_t* m) {
        const std::lock_guard lock(mutex_);
        tracks_[m->sequence] = m->utime;
    }
    void on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* m) {
        const std::lock_guard lock(mutex_);
        statuses_.push_back(*m);
    }

    lcm::LCM lcm_;
    mutable std::mutex mutex_;
    std::vector<pose_t> poses_;
    std::vector<pose_t> predicted_poses_;
    std::map<std::int64_t, std::int64_t> masks_;
    std::map<std::int64_t, std::int64_t> tracks_;
    std::vector<status_t> statuses_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// A counter of a status message; -1 where it has none of this name.
inline std::int64_t counter(const status_t& status, const std::string& name) {
    for (std::size_t i = 0; i < status.counter_name.size(); ++i) {
        if (status.counter_name[i] == name) return status.counter_value[i];
    }
    return -1;
}

}  // namespace dlod::test
