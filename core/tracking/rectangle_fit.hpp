// The direction of a vehicle's sides from the points on them.
#pragma once

#include <optional>

#include "core/tracking/bounding_box.hpp"

namespace dlod {

/// Yaw [rad] in [0, pi / 2) of the upright rectangle whose sides the points lie on best: the mean distance to the
/// nearest side, bounded, is the least. Principal axes fail here: of two visible sides they give the diagonal. Nothing
/// where no direction is clearly better than the others.
std::optional<double> rectangle_yaw(const PointSpan& points);

}  // namespace dlod
