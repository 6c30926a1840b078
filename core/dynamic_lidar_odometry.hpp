// The whole method in its plain sequential form (Lichtenfeld, Daun, von Stryk: Efficient Dynamic LiDAR Odometry for
// Mobile Robots with Structured Point Clouds, IROS 2024). The staged pipeline of the daemon calls the same steps.
#pragma once

#include "core/method_config.hpp"
#include "core/odometry/feedback.hpp"
#include "core/types/frame.hpp"

#include <array>

namespace dlod {

/// Stages 1 to 4 touch disjoint members: different threads may run them side by side on different frames, as long as
/// each stage sees the frames in order and the feedback of frame k reaches estimate_pose of frame k + kFeedbackDelay.
class DynamicLidarOdometry {
  public:
    DynamicLidarOdometry(const SensorModel& sensor, const MethodConfig& config);

    /// Everything for one frame whose cloud has been filled by the geometry. Frames in order.
    void process(Frame& frame);

    void prepare(Frame& frame);                                             ///< stage 1: needs no pose
    void estimate_pose(Frame& frame, const OdometryFeedback* feedback);     ///< stage 2
    void detect_and_track(Frame& frame, OdometryFeedback& feedback);        ///< stage 3
    void update_map(const Frame& frame);                                    ///< stage 4

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
