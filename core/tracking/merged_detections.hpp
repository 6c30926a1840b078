// Detections that cover more than one object: two people side by side in one segment, a person against a wall.
#pragma once

#include <algorithm>
#include <numbers>
#include <span>
#include <vector>

#include "core/tracking/association.hpp"
#include "core/tracking/box_iou.hpp"
#include "core/tracking/detection_shapes.hpp"

namespace dlod {

/// Divides each detection that covers several tracks between them, pixel by pixel: each pixel goes to the track whose
/// expected box is nearer and, between people and the like, to the body that it is nearer to then. What is far too
/// large to be the one moving track that it covers is divided into what lies inside of the track's box and the rest.
/// What moves and falls apart above the legs is two people. What the detection says about motion is shared by the
/// pixels. Keeps its memory.
class MergedDetections {
  public:
    explicit MergedDetections(const SensorModel& sensor)
        : column_rad_(2.0F * std::numbers::pi_v<float> / static_cast<float>(sensor.width)) {}

    /// @param tracks expected in this frame; only `steady` ones take part
    /// @param detection_of each track, were nothing divided; -1 for none: what is seen elsewhere takes no part
    /// @return whether any detection was divided
    bool divide(Frame& frame, DetectionShapes& shapes, std::span<const ExpectedTrack> tracks,
                std::span<const int> detection_of);

    /// The track of each detection that is a body's share of a divided one, -1 of others.
    std::span<const int> known_tracks() const { return known_; }

    /// Whether a detection of the frame was cut out of a larger one: it says nothing of its object's size.
    bool is_cut(std::size_t detection) const { return std::binary_search(cut_.begin(), cut_.end(), detection); }

    /// Whether it is one of two objects that were one detection, by its shape: no part of the other.
    bool is_apart(std::size_t detection) const {
        return std::find(apart_.begin(), apart_.end(), detection) != apart_.end();
    }

  private:
    /// Fills owner_ and counts_ for the tracks covered_; false where a part would be too small.
    bool share_out(const Detection& whole, const DetectionShapes& shapes, std::span<const ExpectedTrack> tracks);
    /// Gives each point to the nearest of the middles of the parts' upper bodies, where enough of each is seen.
    void share_by_middles(const Detection& whole, const DetectionShapes& shapes);
    /// Whether those middles may be those of different bodies.
    bool stand_apart() const;
    /// Likewise for the one track covered_ and the rest.
    bool cut_out(const Detection& whole, const DetectionShapes& shapes, const ExpectedTrack& track);
    /// Likewise for two people who stand apart, one half hidden by the other: there is a gap between their upper
    /// bodies.
    bool fall_apart(const Detection& whole, const DetectionShapes& shapes, std::size_t index);
    /// Divides a detection by owner_ and counts_.
    void divide_one(Frame& frame, DetectionShapes& shapes, std::size_t index);

    struct Middle {
        float x = 0.0F, y = 0.0F, count = 0.0F;
    };

    float column_rad_;
    std::vector<Middle> middles_;
    bool bodies_ = false;  ///< the tracks covered_ are those of people and the like, one as tall as the other
    std::vector<std::size_t> covered_;
    std::vector<Footprint> footprints_;  ///< of the visible boxes of the tracks covered_
    std::vector<int> known_;
    std::vector<std::size_t> cut_;  ///< ascending
    std::vector<std::size_t> apart_;
    std::vector<std::size_t> owner_, counts_;
    std::vector<PixelIndex> pixels_;
    std::vector<std::int8_t> motion_;
    std::vector<float> x_, y_, z_, along_;
};

}  // namespace dlod
