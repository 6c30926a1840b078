// The whole method in its plain sequential form (Lichtenfeld, Daun, von Stryk: Efficient Dynamic LiDAR Odometry for
// Mobile Robots with Structured Point Clouds, IROS 2024). The staged pipeline of the daemon calls the same steps.
#pragma once

#include "core/method_config.hpp"
#include "core/odometry/feedback.hpp"
#include "core/types/frame.hpp"

#include <array>

namespace dlod {

/// Each step touches members of its own: different threads may run different steps side by side on different frames, as
/// long as each step sees the frames in order, a frame passes the steps in order, and the feedback of the n-th frame
/// reaches estimate_pose of frame n + kFeedbackDelay.
class DynamicLidarOdometry {
  public:
    DynamicLidarOdometry(const SensorModel& sensor, const MethodConfig& config);

    /// Everything for one frame whose cloud has been filled by the geometry. Frames in order.
    void process(Frame& frame);

    // Preparation: needs no pose.
    void subsample(Frame& frame);
    void remove_ground(Frame& frame);
    void segment(Frame& frame);
    /// Two-stage registration. @param feedback of the frame kFeedbackDelay before, nullptr for the first ones
    void estimate_pose(Frame& frame, const OdometryFeedback* feedback);
    // Without a pose that follows the map nothing is detected and tracks are predicted only; with the handling of
    // dynamic objects off there are none.
    void detect(Frame& frame);
    void track(Frame& frame);
    /// Labels every pixel and fills `feedback`.
    void remove_dynamic_points(Frame& frame, OdometryFeedback& feedback);
    void update_map(const Frame& frame);

    GlobalMap& map() { return map_; }
    const Image<float>& residual_image() const { return detector_.residual_image(); }

  private:
    bool handle_dynamic_objects_;
    Subsampling subsampling_;
    GroundRemoval ground_removal_;
    RangeImageSegmentation segmentation_;
    Odometry odometry_;
    Detector detector_;
    Tracker tracker_;
    DynamicPointsRemoval removal_;
    GlobalMap map_;
    std::array<OdometryFeedback, kFeedbackDelay> feedback_;  ///< of process(): a ring over the frames
    std::uint64_t frames_ = 0;
};

}  // namespace dlod
