#include "core/map/keyframe_hulls.hpp"

// With their definitions, to be compiled here: libpcl_surface brings VTK along, and loading that takes as long
// as three frames.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/concave_hull.h>
#include <pcl/surface/convex_hull.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <pcl/surface/impl/concave_hull.hpp>
#include <pcl/surface/impl/convex_hull.hpp>

namespace dlod {
namespace {

// Positions whose spread across their main direction is smaller than this have no hull worth the name.
constexpr double kLeastSpread_m = 0.05;

/// Positions relative to the first one, in the plane; nullptr where they have no hull.
pcl::PointCloud<pcl::PointXYZ>::Ptr in_plane(std::span<const Eigen::Vector3d> positions) {
    if (positions.size() < 4) return nullptr;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& p : positions) mean += p.head<2>() / static_cast<double>(positions.size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const auto& p : positions) spread += (p.head<2>() - mean) * (p.head<2>() - mean).transpose();
    spread /= static_cast<double>(positions.size());
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
    solver.computeDirect(spread, Eigen::EigenvaluesOnly);
    if (solver.eigenvalues()[0] < kLeastSpread_m * kLeastSpread_m) return nullptr;
    auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    for (const auto& p : positions) {
        const Eigen::Vector2f q = (p.head<2>() - positions.front().head<2>()).cast<float>();
        cloud->push_back(pcl::PointXYZ(q.x(), q.y(), 0.0F));
    }
    return cloud;
}

template <class Hull>
std::vector<std::size_t> indices_of(Hull& hull, const pcl::PointCloud<pcl::PointXYZ>::Ptr& cloud) {
    hull.setInputCloud(cloud);
    hull.setDimension(2);
    pcl::PointCloud<pcl::PointXYZ> rim;
    hull.reconstruct(rim);
    pcl::PointIndices indices;
    hull.getHullPointIndices(indices);
    std::vector<std::size_t> result(indices.indices.begin(), indices.indices.end());
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
}

}  // namespace

std::vector<std::size_t> convex_hull(std::span<const Eigen::Vector3d> positions_m) {
    const auto cloud = in_plane(positions_m);
    if (cloud == nullptr) return {};
    pcl::ConvexHull<pcl::PointXYZ> hull;
    return indices_of(hull, cloud);
}

std::vector<std::size_t> concave_hull(std::span<const Eigen::Vector3d> positions_m, double alpha_m) {
    const auto cloud = in_plane(positions_m);
    if (cloud == nullptr) return {};
    pcl::ConcaveHull<pcl::PointXYZ> hull;
    hull.setAlpha(alpha_m);
    hull.setKeepInformation(true);
    return indices_of(hull, cloud);
}

}  // namespace dlod
