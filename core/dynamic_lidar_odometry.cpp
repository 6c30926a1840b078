#include "core/dynamic_lidar_odometry.hpp"

namespace dlod {

namespace {

/// Without the handling of dynamic objects every point enters the map, at once and for good.
GlobalMapConfig map_config(const MethodConfig& config) {
    GlobalMapConfig map = config.map;
    if (!config.handle_dynamic_objects) map.confirm_s = 0.0;
    return map;
}

}  // namespace

DynamicLidarOdometry::DynamicLidarOdometry(const SensorModel& sensor, const MethodConfig& config)
    : handle_dynamic_objects_(config.handle_dynamic_objects),
      subsampling_(sensor, config.subsampling),
      ground_removal_(sensor, config.ground),
      segmentation_(sensor, config.segmentation),
      odometry_(sensor, config.odometry),
      detector_(sensor, config.detection),
      tracker_(sensor, config.tracking),
      removal_(sensor, config.removal),
      map_(sensor, map_config(config)) {}

void DynamicLidarOdometry::process(Frame& frame) {
    OdometryFeedback& slot = feedback_[frames_ % kFeedbackDelay];
    subsample(frame);
    remove_ground(frame);
    segment(frame);
    estimate_pose(frame, frames_ >= kFeedbackDelay ? &slot : nullptr);
    detect(frame);
    track(frame);
    remove_dynamic_points(frame, slot);
    update_map(frame);
    ++frames_;
}

void DynamicLidarOdometry::subsample(Frame& frame) {
    subsampling_.process(frame);
}

void DynamicLidarOdometry::remove_ground(Frame& frame) {
    ground_removal_.process(frame);
}

void DynamicLidarOdometry::segment(Frame& frame) {
    segmentation_.process(frame);
}

void DynamicLidarOdometry::estimate_pose(Frame& frame, const OdometryFeedback* feedback) {
    odometry_.process(frame, feedback);
}

void DynamicLidarOdometry::detect(Frame& frame) {
    frame.detection.clear();
    if (handle_dynamic_objects_) detector_.process(frame);
}

void DynamicLidarOdometry::track(Frame& frame) {
    // A frame without any column has no time to predict to.
    if (handle_dynamic_objects_ && frame.header.valid_columns > 0) tracker_.process(frame);
}

void DynamicLidarOdometry::remove_dynamic_points(Frame& frame, OdometryFeedback& feedback) {
    removal_.process(frame, feedback);
}

void DynamicLidarOdometry::update_map(const Frame& frame) {
    if (frame.odometry.valid) map_.update(frame);
}

}  // namespace dlod
