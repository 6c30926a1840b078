#pragma once

#include <Eigen/Core>
#include <vector>

namespace dlod::tools {

/// The one-to-one assignment of least cost, by the Hungarian method: for each row its column, -1 where rows outnumber
/// columns. All costs finite.
std::vector<int> assign(const Eigen::MatrixXd& cost);

}  // namespace dlod::tools
