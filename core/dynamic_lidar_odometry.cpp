#include "core/dynamic_lidar_odometry.hpp"

namespace dlod {

DynamicLidarOdometry::DynamicLidarOdometry(const SensorModel& sensor, const MethodConfig& config)
    : handle_dynamic_objects_(config.handle_dynamic_objects),
      subsampling_(sensor, config.subsampling),
      ground_removal_(sensor, config.ground),
      segmentation_(sensor, config.segmentation),
      odometry_(sensor, config.odometry),
      detector_(sensor, config.detection),
      tracker_(sensor, config.tracking),
      removal_(sensor, config.removal),
      map_(sensor, config.map) {}

void DynamicLidarOdometry::process(Frame& frame) {
    OdometryFeedback& slot = feedback_[frames_ % kFeedbackDelay];
    prepare(frame);
    estimate_pose(frame, frames_ >= kFeedbackDelay ? &slot : nullptr);
    detect_and_track(frame, slot);
    update_map(frame);
    ++frames_;
}

void DynamicLidarOdometry::prepare(Frame& frame) {
    subsampling_.process(frame);
    ground_removal_.process(frame);
    segmentation_.process(frame);
}

void DynamicLidarOdometry::estimate_pose(Frame& frame, const OdometryFeedback* feedback) { odometry_.process(frame, feedback); }

void DynamicLidarOdometry::detect_and_track(Frame& frame, OdometryFeedback& feedback) {
    if (handle_dynamic_objects_) {
        detector_.process(frame);
        tracker_.process(frame);
    } else {
        frame.detection.clear();
    }
    removal_.process(frame, feedback);
}

void DynamicLidarOdometry::update_map(const Frame& frame) { map_.update(frame); }

}  // namespace dlod
