#include "core/removal/dynamic_points_removal.hpp"

namespace dlod {

void DynamicPointsRemoval::process(Frame& frame, OdometryFeedback& feedback) {
    auto& detection = frame.detection;
    detection.instance.fill(0);
    detection.dynamic_points = 0;
    for (std::size_t i = 0; i < detection.label.size(); ++i) {
        detection.label[i] = static_cast<std::uint8_t>(frame.raw.range_mm[i] != 0 ? PixelLabel::kStatic : PixelLabel::kNoReturn);
    }
    feedback.sequence = frame.header.sequence;
    feedback.stamp_ns = frame.header.stamp_ns;
    feedback.moving.clear();
    feedback.has_keyframe = false;
    feedback.cleared.clear();
}

}  // namespace dlod
