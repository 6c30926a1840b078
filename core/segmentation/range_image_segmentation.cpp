#include "core/segmentation/range_image_segmentation.hpp"

namespace dlod {

void RangeImageSegmentation::process(Frame& frame) {
    frame.prepared.segment.fill(0);
    frame.prepared.segments.clear();
    frame.prepared.pixels.clear();
}

}  // namespace dlod
