#include "core/preprocess/subsampling.hpp"

namespace dlod {

void Subsampling::process(Frame& frame) { frame.prepared.points.clear(); }

}  // namespace dlod
