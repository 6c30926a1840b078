// All that a session says over LCM.
#pragma once

#include <chrono>
#include <cstdint>
#include <dlod/status_t.hpp>
#include <functional>
#include <memory>
#include <utility>

#include "daemon/publish/frame_publisher.hpp"
#include "daemon/publish/lcm_bus.hpp"
#include "daemon/publish/pose_publisher.hpp"
#include "daemon/publish/predicted_pose_publisher.hpp"
#include "daemon/publish/predicted_pose_thread.hpp"
#include "daemon/publish/sensor_announcer.hpp"

namespace dlod::daemon {

class SessionMessages {
  public:
    /// Opens LCM. Where poses are predicted, a thread begins here.
    /// @param patience how long a message waits for a server that takes none (QueuedBus)
    /// @param on_thread_start called first on the thread; may be empty
    /// @throws MessageBusError
    SessionMessages(const LcmConfig& config, const driver::SensorInfo& sensor, const MotionFilterConfig& motion,
                    const Eigen::Isometry3d& T_base_sensor, std::chrono::milliseconds patience,
                    std::function<void()> on_thread_start)
        : bus_(open_lcm(config.url, patience)),
          poses_(*bus_, T_base_sensor, config),
          predicted_poses_(*bus_, sensor.model, motion, T_base_sensor, config),
          frames_(*bus_, sensor.model, T_base_sensor, config),
          sensor_(*bus_, sensor, T_base_sensor, config.channel_prefix),
          status_(*bus_),
          status_channel_(config.channel_prefix + "STATUS") {
        if (config.predicted_pose_every == 0) return;
        prediction_ = std::make_unique<PredictedPoseThread>(
            [this](const ImuSample& sample) { predicted_poses_.publish(sample); }, std::move(on_thread_start));
    }

    MessageBus& bus() { return *bus_; }

    /// A frame's pose. @param utime [us]. On one thread.
    void publish_pose(const Frame& frame, std::int64_t utime) {
        poses_.publish(frame, utime);
        predicted_poses_.see(frame, utime);
    }
    /// Where the robot is by now. On the thread that receives, which does not wait for the message.
    void publish_predicted_pose(const ImuSample& sample) {
        if (prediction_) prediction_->add(sample);
    }
    /// The rest of its results. @param utime [us]. On one thread, which may be another one.
    void publish(const Frame& frame, std::int64_t utime) { frames_.publish(frame, utime); }

    // The following on one thread, which may be a third one.

    /// The sensor's description, where it is due. @param now_ns CLOCK_MONOTONIC @param utime [us] host time
    void announce_sensor(std::int64_t now_ns, std::int64_t utime) { sensor_.announce_if_due(now_ns, utime); }
    void send(const status_t& status) { status_.send(status_channel_, status); }

    /// Messages that could not be sent, or not in time; from any thread.
    std::uint64_t failed() const {
        return poses_.failed() + predicted_poses_.failed() + (prediction_ ? prediction_->left_out() : 0) +
               frames_.failed() + sensor_.failed() + status_.failed() + bus_->lost();
    }

  private:
    std::unique_ptr<MessageBus> bus_;
    PosePublisher poses_;
    PredictedPosePublisher predicted_poses_;
    FramePublisher frames_;
    SensorAnnouncer sensor_;
    MessageSender status_;
    std::string status_channel_;
    std::unique_ptr<PredictedPoseThread> prediction_;  // last: its thread uses the above
};

}  // namespace dlod::daemon
