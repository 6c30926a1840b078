// Hulls of the keyframes' positions in the ground plane (Chen et al., DLO): which keyframes lie at the rim of what has
// been visited. PCL computes them; this file hides it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace dlod {

/// Indices of the positions on their convex hull, ascending. Empty for fewer than four, or when they lie on a line.
std::vector<std::size_t> convex_hull(std::span<const Eigen::Vector3d> positions_m);

/// The same of their concave hull.
/// @param alpha_m largest radius of a circle that may dent the hull
std::vector<std::size_t> concave_hull(std::span<const Eigen::Vector3d> positions_m, double alpha_m);

}  // namespace dlod
