// Poses between frames: the last frame's, carried on by each reading of the IMU.
#pragma once

#include <cstdint>
#include <dlod/pose_t.hpp>
#include <string>

#include "core/odometry/imu_prediction.hpp"
#include "core/types/sensor_model.hpp"
#include "daemon/pipeline/latest_value.hpp"
#include "daemon/publish/message_config.hpp"
#include "daemon/publish/message_sender.hpp"

namespace dlod::daemon {

class PredictedPosePublisher {
  public:
    PredictedPosePublisher(MessageBus& bus, const SensorModel& sensor, const MotionFilterConfig& motion,
                           const Eigen::Isometry3d& T_base_sensor, const LcmConfig& config);

    /// The pose to go on from. On the thread of poses. @param utime of the frame's messages [us]
    void see(const Frame& frame, std::int64_t utime);
    /// On one thread, which may be another one.
    void publish(const ImuSample& sample);

    /// Messages that could not be sent; from any thread.
    std::uint64_t failed() const { return sender_.failed(); }

  private:
    struct Start {
        bool known = false;  ///< false: no pose to go on from
        std::int64_t stamp_ns = 0;
        std::int64_t utime = 0;
        std::int64_t sequence = 0;
        SensorMotion motion;
        ImuCorrection correction;
    };

    MessageSender sender_;
    Eigen::Isometry3d T_base_sensor_;
    std::string channel_;
    int every_;
    LatestValue<Start> newest_;
    // Of the thread that publishes.
    ImuPrediction prediction_;
    Start start_;
    int readings_ = 0;               ///< since the last message
    std::int64_t published_ns_ = 0;  ///< sensor clock
    pose_t pose_{};
};

}  // namespace dlod::daemon
