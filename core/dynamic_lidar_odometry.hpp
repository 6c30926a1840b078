// The whole method in its plain sequential form (Lichtenfeld, Daun, von Stryk: Efficient Dynamic LiDAR Odometry for
// Mobile Robots with Structured Point Clouds, IROS 2024). The staged pipeline of the daemon calls the same steps.
#pragma once

#include "core/method_config.hpp"
#include "core/odometry/feedback.hpp"
#include "core/types/frame.hpp"

#include <array>
#include <optional>

namespace dlod {

/// Each step touches members of its own: different threads may run different steps side by side on different frames, as
/// long as each step sees the frames in order, a frame passes the steps in order, and the feedback of the n-th frame
/// reaches estimate_pose of frame n + kFeedbackDelay. With a frame whose `restart` is set everything begins anew: pose,
/// maps and tracks are those of a first frame, only track ids go on.
class DynamicLidarOdometry {
  public:
    DynamicLidarOdometry(const SensorModel& sensor, const MethodConfig& config);

    /// Everything for one frame whose cloud has been filled by the geometry. Frames in order.
    void process(Frame& frame);

    // Preparation: needs no pose.
    void subsample(Frame& frame);
    void remove_ground(Frame& frame);
    void segment(Frame& frame);
    /// Two-stage registration. @param feedback of the frame kFeedbackDelay before; the first ones after a start have none
    /// and do not look at it
    void estimate_pose(Frame& frame, const OdometryFeedback& feedback);
    // Without a pose that follows the map nothing is detected and tracks are predicted only; with the handling of
    // dynamic objects off there are none.
    void detect(Frame& frame);
    void track(Frame& frame);
    /// Labels every pixel and fills `feedback`.
    void remove_dynamic_points(Frame& frame, OdometryFeedback& feedback);
    void update_map(const Frame& frame);

    GlobalMap& map() { return *map_; }
    const Image<float>& residual_image() const { return detector_->residual_image(); }

  private:
    SensorModel sensor_;
    MethodConfig config_;
    Subsampling subsampling_;
    std::optional<GroundRemoval> ground_removal_;  // what remembers earlier frames is made anew at a restart
    RangeImageSegmentation segmentation_;
    std::optional<Odometry> odometry_;
    std::optional<Detector> detector_;
    std::optional<Tracker> tracker_;
    DynamicPointsRemoval removal_;
    std::optional<GlobalMap> map_;
    int poses_since_start_ = 0;  ///< up to kFeedbackDelay
    std::array<OdometryFeedback, kFeedbackDelay> feedback_;  ///< of process(): a ring over the frames
    std::uint64_t frames_ = 0;
};

}  // namespace dlod
