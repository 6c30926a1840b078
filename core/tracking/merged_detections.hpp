// Detections that cover more than one track: two people side by side in one segment.
#pragma once

#include <span>
#include <vector>

#include "core/tracking/association.hpp"
#include "core/tracking/detection_shapes.hpp"

namespace dlod {

/// Divides each detection that covers several tracks between them, pixel by pixel: each pixel goes to the track whose
/// expected box is nearer. What the detection says about motion is shared by the pixels. Keeps its memory.
class MergedDetections {
  public:
    /// @param tracks expected in this frame; only `steady` ones take part
    void divide(Frame& frame, DetectionShapes& shapes, std::span<const ExpectedTrack> tracks);

  private:
    void divide_one(Frame& frame, DetectionShapes& shapes, std::span<const ExpectedTrack> tracks, std::size_t index);

    std::vector<std::size_t> covered_;
    std::vector<std::size_t> owner_, counts_;
    std::vector<PixelIndex> pixels_;
    std::vector<float> x_, y_, z_;
};

}  // namespace dlod
