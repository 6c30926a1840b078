// Dynamic points removal (paper, Sec. "Dynamic Points Removal"): labels every pixel, and keeps the points of non-static
// objects out of keyframes and map.
#pragma once

#include "core/odometry/feedback.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct RemovalConfig {
    double margin_m = 0.1;

    template <class V>
    void visit(V& v) {
        v.parameter("margin_m", margin_m, Range{0.0, 1.0}, "m",
                    "boxes are grown by this much on every side when their past is cleared");
    }
};

/// Fills frame.detection.label, .instance (0 before: take_back()) and .dynamic_points from this frame's detections
/// alone (a track that is only predicted marks no pixel), and the feedback to the odometry: boxes of moving objects,
/// boxes to clear, and the keyframe without the points of objects that are dynamic. Grows frame.detection.cleared by
/// the margin. A frame whose odometry is not valid knows no ground and no moving object.
class DynamicPointsRemoval {
  public:
    DynamicPointsRemoval(const SensorModel& sensor, const RemovalConfig& config) : sensor_(sensor), config_(config) {}
    void process(Frame& frame, OdometryFeedback& feedback);
    /// Unmarks the objects of the frame that was in this workspace before: frame.detection.instance is 0 again. To be
    /// called before its detections are cleared.
    static void take_back(Frame& frame);

  private:
    void label_pixels(Frame& frame) const;
    void fill_keyframe(const Frame& frame, OdometryFeedback& feedback) const;

    SensorModel sensor_;
    RemovalConfig config_;
};

}  // namespace dlod
