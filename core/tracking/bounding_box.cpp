#include "core/tracking/bounding_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dlod {

namespace {

/// Lowest and highest coordinate along the axis (c, s).
std::pair<float, float> extent_along(const PointSpan& p, float c, float s) {
    float low = std::numeric_limits<float>::max();
    float high = std::numeric_limits<float>::lowest();
    for (std::size_t i = 0; i < p.size(); ++i) {
        const float u = c * p.x[i] + s * p.y[i];
        low = std::min(low, u);
        high = std::max(high, u);
    }
    return {low, high};
}

}  // namespace

PointSpan points_of(const LocalPoints& points, std::size_t first, std::size_t count) {
    const auto part = [&](const std::vector<float>& v) { return std::span<const float>(v).subspan(first, count); };
    return {part(points.x), part(points.y), part(points.z)};
}

void gather_points(std::span<const PixelIndex> pixels, const Image<float>& x, const Image<float>& y,
                   const Image<float>& z, const Eigen::Isometry3d& T_world_sensor, LocalPoints& out) {
    out.origin_m = T_world_sensor.translation();
    out.resize(pixels.size());
    const Eigen::Matrix3f R = T_world_sensor.linear().cast<float>();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const Eigen::Vector3f p = R * Eigen::Vector3f(x[pixels[i]], y[pixels[i]], z[pixels[i]]);
        out.x[i] = p.x();
        out.y[i] = p.y();
        out.z[i] = p.z();
    }
}

PrincipalAxis principal_axis(const PointSpan& points, const Eigen::Vector3d& origin_m) {
    PrincipalAxis axis;
    const std::size_t n = points.size();
    if (n == 0) {
        axis.centroid_m = origin_m;
        return axis;
    }
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < n; ++i) mean += Eigen::Vector3d(points.x[i], points.y[i], points.z[i]);
    mean /= static_cast<double>(n);
    double xx = 0.0, xy = 0.0, yy = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        const double dx = points.x[i] - mean.x();
        const double dy = points.y[i] - mean.y();
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
    }
    axis.centroid_m = origin_m + mean;
    const double half_trace = 0.5 * (xx + yy);
    const double root = std::hypot(0.5 * (xx - yy), xy);
    // Below a millimetre of spread the direction is rounding.
    if (half_trace < 1e-6 * static_cast<double>(n)) return axis;
    axis.yaw_rad = 0.5 * std::atan2(2.0 * xy, xx - yy);
    axis.elongation = std::sqrt((half_trace + root) / std::max(half_trace - root, 1e-4 * (half_trace + root)));
    return axis;
}

OrientedBox box_at_yaw(const PointSpan& points, const Eigen::Vector3d& origin_m, double yaw_rad, double min_side_m) {
    OrientedBox box;
    box.yaw_rad = yaw_rad;
    if (points.size() == 0) {
        box.center_m = origin_m;
        box.size_m.setConstant(min_side_m);
        return box;
    }
    const double c = std::cos(yaw_rad);
    const double s = std::sin(yaw_rad);
    const auto [u0, u1] = extent_along(points, static_cast<float>(c), static_cast<float>(s));
    const auto [v0, v1] = extent_along(points, static_cast<float>(-s), static_cast<float>(c));
    const auto [z0, z1] = std::minmax_element(points.z.begin(), points.z.end());
    const double u = 0.5 * (static_cast<double>(u0) + u1);
    const double v = 0.5 * (static_cast<double>(v0) + v1);
    box.center_m = origin_m + Eigen::Vector3d(c * u - s * v, s * u + c * v, 0.5 * (static_cast<double>(*z0) + *z1));
    box.size_m = Eigen::Vector3d(u1 - u0, v1 - v0, *z1 - *z0).cwiseMax(min_side_m);
    return box;
}

OrientedBox bounding_box(std::span<const PixelIndex> pixels, const Image<float>& x, const Image<float>& y,
                         const Image<float>& z, const Eigen::Isometry3d& T_world_sensor) {
    LocalPoints points;
    gather_points(pixels, x, y, z, T_world_sensor, points);
    const PointSpan all = points_of(points, 0, points.size());
    return box_at_yaw(all, points.origin_m, principal_axis(all, points.origin_m).yaw_rad);
}

double wrap_angle(double rad) {
    return std::remainder(rad, 2.0 * std::numbers::pi);
}

double resolve_yaw(double yaw_rad, double reference_rad) {
    return reference_rad + std::remainder(yaw_rad - reference_rad, std::numbers::pi);
}

}  // namespace dlod
