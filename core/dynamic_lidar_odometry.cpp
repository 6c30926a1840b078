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
    : sensor_(sensor),
      config_(config),
      subsampling_(sensor, config.subsampling),
      ground_removal_(std::in_place, sensor, config.ground),
      segmentation_(sensor, config.segmentation),
      odometry_(std::in_place, sensor, config.odometry),
      detector_(std::in_place, sensor, config.detection),
      tracker_(std::in_place, sensor, config.tracking),
      removal_(sensor, config.removal),
      map_(std::in_place, sensor, map_config(config)) {}

void DynamicLidarOdometry::process(Frame& frame) {
    OdometryFeedback& slot = feedback_[frames_ % kFeedbackDelay];
    subsample(frame);
    remove_ground(frame);
    segment(frame);
    estimate_pose(frame, slot);
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
    if (frame.restart) ground_removal_.emplace(sensor_, config_.ground);
    ground_removal_->process(frame);
}

void DynamicLidarOdometry::segment(Frame& frame) {
    segmentation_.process(frame);
}

void DynamicLidarOdometry::estimate_pose(Frame& frame, const OdometryFeedback& feedback) {
    if (frame.restart) {
        odometry_.emplace(sensor_, config_.odometry);
        poses_since_start_ = 0;
    }
    odometry_->process(frame, poses_since_start_ < kFeedbackDelay ? nullptr : &feedback);
    if (poses_since_start_ == 0) frame.odometry.flags |= OdometryResult::kStarted;
    if (poses_since_start_ < kFeedbackDelay) ++poses_since_start_;
}

void DynamicLidarOdometry::detect(Frame& frame) {
    if (frame.restart) detector_.emplace(sensor_, config_.detection);
    DynamicPointsRemoval::take_back(frame);
    frame.detection.clear();
    if (config_.handle_dynamic_objects) detector_->process(frame);
}

void DynamicLidarOdometry::track(Frame& frame) {
    if (frame.restart) tracker_.emplace(sensor_, config_.tracking, tracker_->next_id());
    // A frame without any column has no time to predict to.
    if (config_.handle_dynamic_objects && frame.header.valid_columns > 0) tracker_->process(frame);
}

void DynamicLidarOdometry::remove_dynamic_points(Frame& frame, OdometryFeedback& feedback) {
    removal_.process(frame, feedback);
}

void DynamicLidarOdometry::update_map(const Frame& frame) {
    if (frame.restart) map_.emplace(sensor_, map_config(config_));
    if (frame.odometry.valid) map_->update(frame);
}

}  // namespace dlod
