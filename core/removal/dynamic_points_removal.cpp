#include "core/removal/dynamic_points_removal.hpp"

#include "core/map/keyframe_cloud.hpp"
#include "core/types/multiversion.hpp"

namespace dlod {

namespace {

constexpr auto kNoReturn = static_cast<std::uint8_t>(PixelLabel::kNoReturn);
constexpr auto kStatic = static_cast<std::uint8_t>(PixelLabel::kStatic);
constexpr auto kDynamic = static_cast<std::uint8_t>(PixelLabel::kDynamic);
constexpr auto kUndecided = static_cast<std::uint8_t>(PixelLabel::kUndecided);
constexpr auto kGround = static_cast<std::uint8_t>(PixelLabel::kGround);

/// Labels before any object: nothing, ground or static.
DLOD_MULTIVERSION_512 void label_background(const std::uint32_t* __restrict range,
                                            const std::uint8_t* __restrict ground, std::size_t size,
                                            std::uint8_t* __restrict label) {
    for (std::size_t i = 0; i < size; ++i) {
        const std::uint8_t surface = ground[i] != 0 ? kGround : kStatic;
        label[i] = range[i] != 0 ? surface : kNoReturn;
    }
}

DLOD_MULTIVERSION_512 void label_background_without_ground(const std::uint32_t* __restrict range, std::size_t size,
                                                           std::uint8_t* __restrict label) {
    for (std::size_t i = 0; i < size; ++i) label[i] = range[i] != 0 ? kStatic : kNoReturn;
}

}  // namespace

void DynamicPointsRemoval::process(Frame& frame, OdometryFeedback& feedback) {
    label_pixels(frame);
    feedback.sequence = frame.header.sequence;
    feedback.stamp_ns = frame.header.stamp_ns;
    feedback.moving.clear();
    feedback.has_keyframe = false;
    feedback.cleared.clear();
    if (!frame.odometry.follows_map()) return;

    for (OrientedBox& box : frame.detection.cleared) box.size_m.array() += 2.0 * config_.margin_m;
    feedback.cleared = frame.detection.cleared;
    for (const Track& track : frame.detection.tracks) {
        if (track.state == DynamicState::kDynamic) feedback.moving.push_back({track.box, track.velocity_mps});
    }
    if (frame.odometry.keyframe) fill_keyframe(frame, feedback);
}

// A few pixels instead of the whole image.
void DynamicPointsRemoval::take_back(Frame& frame) {
    for (const PixelIndex pixel : frame.detection.pixels) frame.detection.instance[pixel] = 0;
}

void DynamicPointsRemoval::label_pixels(Frame& frame) const {
    DetectionResult& result = frame.detection;
    result.dynamic_points = 0;
    const bool valid = frame.odometry.follows_map();
    if (valid) {
        label_background(frame.raw.range_mm.data(), frame.prepared.ground.data(), result.label.size(),
                         result.label.data());
    } else {
        label_background_without_ground(frame.raw.range_mm.data(), result.label.size(), result.label.data());
    }
    for (const Detection& detection : result.detections) {
        const Track* track =
            valid && detection.track >= 0 ? &result.tracks[static_cast<std::size_t>(detection.track)] : nullptr;
        const DynamicState state = track != nullptr ? track->state : DynamicState::kUndefined;
        const std::uint8_t label = state == DynamicState::kDynamic  ? kDynamic
                                   : state == DynamicState::kStatic ? kStatic
                                                                    : kUndecided;
        const std::uint32_t instance = track != nullptr ? track->id : 0;
        for (std::uint32_t i = detection.first; i < detection.first + detection.count; ++i) {
            const PixelIndex pixel = result.pixels[i];
            result.label[pixel] = label;
            result.instance[pixel] = instance;
        }
        if (label == kDynamic) result.dynamic_points += static_cast<int>(detection.count);
    }
}

void DynamicPointsRemoval::fill_keyframe(const Frame& frame, OdometryFeedback& feedback) const {
    // What is not decided yet mostly stands still, and there may be much of it when a map begins: without it little
    // tells the motion. Should it turn out to move, its past is cleared.
    const auto moves = [&](PixelIndex pixel) { return frame.detection.label[pixel] == kDynamic; };
    build_keyframe_cloud(frame, moves, feedback.keyframe);
    feedback.has_keyframe = true;
}

}  // namespace dlod
