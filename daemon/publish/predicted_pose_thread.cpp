#include "daemon/publish/predicted_pose_thread.hpp"

#include <utility>

namespace dlod::daemon {

PredictedPoseThread::PredictedPoseThread(std::function<void(const ImuSample&)> publish, std::function<void()> on_start)
    : publish_(std::move(publish)), thread_([this, on_start = std::move(on_start)] {
          if (on_start) on_start();
          work();
      }) {}

PredictedPoseThread::~PredictedPoseThread() {
    stopping_.store(true);
    events_.notify();
    thread_.join();
}

void PredictedPoseThread::add(const ImuSample& sample) {
    if (!waiting_.push(sample)) ++left_out_;
    events_.notify();
}

void PredictedPoseThread::work() {
    while (true) {
        // Drawn before anything is looked at: what happens from here on ends the wait.
        const auto ticket = events_.ticket();
        if (stopping_.load()) return;
        ImuSample sample;
        if (waiting_.pop(sample)) {
            publish_(sample);
        } else {
            events_.wait(ticket);
        }
    }
}

}  // namespace dlod::daemon
