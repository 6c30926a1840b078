// PCL's own versions of what dlod does its own way, behind an interface without PCL: its headers are seen by one file.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace dlod::test {

/// Centroids of the occupied cells, by pcl::VoxelGrid.
std::vector<Eigen::Vector3f> pcl_voxel_grid(std::span<const Eigen::Vector3f> cloud, float leaf_m, unsigned min_points);

struct PclAlignment {
    bool converged = false;
    Eigen::Isometry3d T_target_source = Eigen::Isometry3d::Identity();
};

/// pcl::GeneralizedIterativeClosestPoint with the settings of the paper's implementation.
PclAlignment pcl_gicp(std::span<const Eigen::Vector3f> source, std::span<const Eigen::Vector3f> target,
                      const Eigen::Isometry3d& guess);

}  // namespace dlod::test
