// Upright boxes around the visible points of an object (paper, Sec. "Tracking and Association").
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/types/image.hpp"
#include "core/types/oriented_box.hpp"

namespace dlod {

/// Points in axes parallel to the world's, structure of arrays, relative to an origin nearby (floats stay exact far
/// from the world's origin).
struct LocalPoints {
    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< world frame
    std::vector<float> x, y, z;                          ///< metres, relative to the origin

    std::size_t size() const { return x.size(); }
    void resize(std::size_t n) {
        x.resize(n);
        y.resize(n);
        z.resize(n);
    }
};

/// A run of points inside LocalPoints.
struct PointSpan {
    std::span<const float> x, y, z;
    std::size_t size() const { return x.size(); }
};

/// Points [first, first + count) of a set.
PointSpan points_of(const LocalPoints& points, std::size_t first, std::size_t count);

/// Takes pixels out of a cloud (sensor frame) and turns them into world axes; the origin is the sensor's position.
/// Reuses the memory of `out`.
void gather_points(std::span<const PixelIndex> pixels, const Image<float>& x, const Image<float>& y,
                   const Image<float>& z, const Eigen::Isometry3d& T_world_sensor, LocalPoints& out);

/// What the ground-plane PCA says about the direction of an object.
struct PrincipalAxis {
    double yaw_rad = 0.0;     ///< of the larger principal axis, in (-pi/2, pi/2]: a line has no front
    double elongation = 1.0;  ///< ratio of the standard deviations, at least 1; the yaw means little near 1
    Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero();  ///< world frame
};

/// PCA in the ground plane. Few points and points on one spot give yaw 0 and elongation 1.
PrincipalAxis principal_axis(const PointSpan& points, const Eigen::Vector3d& origin_m);

/// Smallest upright box of the given yaw around the points, world frame; no side is shorter than `min_side_m`.
OrientedBox box_at_yaw(const PointSpan& points, const Eigen::Vector3d& origin_m, double yaw_rad,
                       double min_side_m = 0.05);

/// The PCA box of some pixels of a cloud (sensor frame), world frame: length along the larger principal axis, yaw in
/// (-pi/2, pi/2]. At least one pixel.
OrientedBox bounding_box(std::span<const PixelIndex> pixels, const Image<float>& x, const Image<float>& y,
                         const Image<float>& z, const Eigen::Isometry3d& T_world_sensor);

/// Angle in (-pi, pi].
double wrap_angle(double rad);

/// A principal axis has no front: of yaw and yaw + pi, the one nearer to the reference, within pi / 2 of it (not
/// wrapped).
double resolve_yaw(double yaw_rad, double reference_rad);

}  // namespace dlod
