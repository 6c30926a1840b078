#include "core/tracking/bounding_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod {

namespace {

/// Lowest and highest coordinate along the axis (c, s), across it, and upwards.
struct Extent {
    float low[3], high[3];
};

constexpr std::size_t kLanes = 8;  // independent minima, so that the compiler may take them side by side

DLOD_MULTIVERSION void extent_along(std::size_t n, const float* __restrict x, const float* __restrict y,
                                    const float* __restrict z, float c, float s, Extent* out) {
    float low[3][kLanes], high[3][kLanes];
    for (std::size_t a = 0; a < 3; ++a) {
        std::fill_n(low[a], kLanes, std::numeric_limits<float>::max());
        std::fill_n(high[a], kLanes, std::numeric_limits<float>::lowest());
    }
    std::size_t i = 0;
    for (; i + kLanes <= n; i += kLanes) {
        for (std::size_t k = 0; k < kLanes; ++k) {
            const float u = c * x[i + k] + s * y[i + k];
            const float v = c * y[i + k] - s * x[i + k];
            const float w = z[i + k];
            low[0][k] = u < low[0][k] ? u : low[0][k];
            high[0][k] = u > high[0][k] ? u : high[0][k];
            low[1][k] = v < low[1][k] ? v : low[1][k];
            high[1][k] = v > high[1][k] ? v : high[1][k];
            low[2][k] = w < low[2][k] ? w : low[2][k];
            high[2][k] = w > high[2][k] ? w : high[2][k];
        }
    }
    for (; i < n; ++i) {
        const float p[3] = {c * x[i] + s * y[i], c * y[i] - s * x[i], z[i]};
        for (std::size_t a = 0; a < 3; ++a) {
            low[a][0] = std::min(low[a][0], p[a]);
            high[a][0] = std::max(high[a][0], p[a]);
        }
    }
    for (std::size_t a = 0; a < 3; ++a) {
        out->low[a] = *std::min_element(low[a], low[a] + kLanes);
        out->high[a] = *std::max_element(high[a], high[a] + kLanes);
    }
}

/// out = R p for the points of `pixel`. @param R row-major 3 x 3
DLOD_MULTIVERSION void rotate_points(std::size_t n, const PixelIndex* __restrict pixel, const float* __restrict x,
                                     const float* __restrict y, const float* __restrict z, const float* __restrict R,
                                     float* __restrict out_x, float* __restrict out_y, float* __restrict out_z) {
    for (std::size_t i = 0; i < n; ++i) {
        const float px = x[pixel[i]], py = y[pixel[i]], pz = z[pixel[i]];
        out_x[i] = R[0] * px + (R[1] * py + R[2] * pz);
        out_y[i] = R[3] * px + (R[4] * py + R[5] * pz);
        out_z[i] = R[6] * px + (R[7] * py + R[8] * pz);
    }
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
    const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> R = T_world_sensor.linear().cast<float>();
    rotate_points(pixels.size(), pixels.data(), x.data(), y.data(), z.data(), R.data(), out.x.data(), out.y.data(),
                  out.z.data());
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
    Extent e;
    extent_along(points.size(), points.x.data(), points.y.data(), points.z.data(), static_cast<float>(c),
                 static_cast<float>(s), &e);
    const auto middle = [&](std::size_t axis) { return 0.5 * (static_cast<double>(e.low[axis]) + e.high[axis]); };
    const auto size = [&](std::size_t axis) { return static_cast<double>(e.high[axis]) - e.low[axis]; };
    const double u = middle(0), v = middle(1);
    box.center_m = origin_m + Eigen::Vector3d(c * u - s * v, s * u + c * v, middle(2));
    box.size_m = Eigen::Vector3d(size(0), size(1), size(2)).cwiseMax(min_side_m);
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
