#include "core/segmentation/ground_removal.hpp"

namespace dlod {

void GroundRemoval::process(Frame& frame) { frame.prepared.ground.fill(0); }

}  // namespace dlod
