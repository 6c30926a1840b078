// Has a partly seen object moved? By the boxes of what was seen of it, as in the paper's rule for dynamic objects.
#pragma once

#include "core/types/oriented_box.hpp"

namespace dlod {

/// How far what was seen as `first` and now as `now` has moved at least, ground plane: both of its ends do, by the
/// same. Only one of them moves where more of a thing comes into view, and both by different lengths where a wall
/// passes behind an opening.
double visible_shift_m(const OrientedBox& first, const OrientedBox& now);

}  // namespace dlod
