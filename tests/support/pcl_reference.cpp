#include "tests/support/pcl_reference.hpp"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>

namespace dlod::test {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr to_pcl(std::span<const Eigen::Vector3f> points) {
    auto cloud = std::make_shared<Cloud>();
    for (const Eigen::Vector3f& p : points) cloud->push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
    return cloud;
}

}  // namespace

std::vector<Eigen::Vector3f> pcl_voxel_grid(std::span<const Eigen::Vector3f> cloud, float leaf_m, unsigned min_points) {
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    grid.setInputCloud(to_pcl(cloud));
    grid.setLeafSize(leaf_m, leaf_m, leaf_m);
    grid.setMinimumPointsNumberPerVoxel(min_points);
    Cloud filtered;
    grid.filter(filtered);
    std::vector<Eigen::Vector3f> centroids;
    for (const auto& p : filtered) centroids.emplace_back(p.x, p.y, p.z);
    return centroids;
}

PclAlignment pcl_gicp(std::span<const Eigen::Vector3f> source, std::span<const Eigen::Vector3f> target,
                      const Eigen::Isometry3d& guess) {
    pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> gicp;
    gicp.setInputSource(to_pcl(source));
    gicp.setInputTarget(to_pcl(target));
    gicp.setMaxCorrespondenceDistance(1.0);
    gicp.setCorrespondenceRandomness(10);
    gicp.setMaximumIterations(32);
    gicp.setTransformationEpsilon(1e-4);
    gicp.setRotationEpsilon(1e-5);
    Cloud aligned;
    gicp.align(aligned, guess.cast<float>().matrix());
    PclAlignment result;
    result.converged = gicp.hasConverged();
    result.T_target_source.matrix() = gicp.getFinalTransformation().cast<double>();
    return result;
}

}  // namespace dlod::test
