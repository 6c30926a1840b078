#include "daemon/publish/predicted_pose_publisher.hpp"

#include <algorithm>

#include "daemon/publish/pose_publisher.hpp"

namespace dlod::daemon {

PredictedPosePublisher::PredictedPosePublisher(MessageBus& bus, const SensorModel& sensor,
                                               const MotionFilterConfig& motion, const Eigen::Isometry3d& T_base_sensor,
                                               const LcmConfig& config)
    : sender_(bus),
      T_base_sensor_(T_base_sensor),
      channel_(config.channel_prefix + "POSE_PREDICTED"),
      every_(config.predicted_pose_every),
      prediction_(sensor.T_sensor_imu, motion) {}

void PredictedPosePublisher::see(const Frame& frame, std::int64_t utime) {
    if (every_ == 0) return;
    const OdometryResult& odometry = frame.odometry;
    newest_.set({.known = odometry.valid && (odometry.flags & OdometryResult::kImuUsed) != 0,
                 .stamp_ns = frame.header.stamp_ns,
                 .utime = utime,
                 .sequence = static_cast<std::int64_t>(frame.header.sequence),
                 .motion = odometry.motion(),
                 .correction = odometry.imu});
}

void PredictedPosePublisher::publish(const ImuSample& sample) {
    if (every_ == 0) return;
    if (const Start* start = newest_.take()) {
        start_ = *start;
        prediction_.end();
        if (start_.known) prediction_.begin(start_.stamp_ns, start_.motion, start_.correction);
    }
    prediction_.add(sample);
    if (++readings_ < every_) return;
    const auto motion = prediction_.motion();
    // A reading that is not believed carries nothing on.
    if (!motion || prediction_.stamp_ns() == published_ns_) return;
    published_ns_ = prediction_.stamp_ns();
    readings_ = 0;
    fill_pose(base_motion(*motion, T_base_sensor_), pose_);
    // The clocks' offset is judged anew with each frame: time must not go back for that. What goes back farther than a
    // pose is carried on is a clock that was set, or a sensor that starts anew, where utime is the sensor's.
    const std::int64_t utime = start_.utime + (prediction_.stamp_ns() - start_.stamp_ns) / 1000;
    const bool is_step = utime < pose_.utime - ImuPrediction::kMost_ns / 1000;
    pose_.utime = is_step ? utime : std::max(pose_.utime, utime);
    pose_.sequence = start_.sequence;
    pose_.flags = +pose_t::VALID + +pose_t::IMU_USED + +pose_t::PREDICTED_ONLY;
    sender_.send(channel_, pose_);
}

}  // namespace dlod::daemon
