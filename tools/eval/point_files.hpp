// Point clouds from files.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace dlod::tools {

using PointList = std::vector<Eigen::Vector3d>;

/// x, y, z of a PCD file of any kind. Throws std::runtime_error naming the file when it cannot be read.
PointList read_pcd(const std::filesystem::path& path);

/// An N x 3 array of little-endian float32 in C order, NumPy's format 1 or 2; throws std::runtime_error naming the file
/// when it holds anything else.
PointList read_npy(const std::filesystem::path& path);

}  // namespace dlod::tools
