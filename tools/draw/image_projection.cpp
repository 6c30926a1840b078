#include "tools/draw/image_projection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace dlod::tools {
namespace {

constexpr int kPixelsPerEdge = 12;
constexpr int kIterations = 3;  // of the column's time: the second moves by less than a pixel

double wrapped(double value, double period) {
    return value - period * std::floor(value / period);
}

}  // namespace

ImageProjection::ImageProjection(const SensorModel& sensor, const Frame& frame, const PoseSeries& trajectory)
    : sensor_(sensor), frame_(frame), trajectory_(trajectory), T_lidar_sensor_(sensor.T_sensor_lidar.inverse()) {}

ImageProjection::Beam ImageProjection::beam_of(const Eigen::Vector3d& in_sensor) const {
    const Eigen::Vector3d p = T_lidar_sensor_ * in_sensor;
    const auto& altitude = sensor_.altitude_rad;
    const double elevation = std::atan2(p.z() - static_cast<double>(sensor_.beam_origin_height_m),
                                        p.head<2>().norm() - static_cast<double>(sensor_.beam_origin_m));
    // Beams descend from row 0: the first one at or below the point, and the share of the way to it.
    std::size_t below = 1;
    while (below + 1 < altitude.size() && static_cast<double>(altitude[below]) > elevation) ++below;
    const double above = static_cast<double>(altitude[below - 1]);
    const double row =
        static_cast<double>(below) - 1.0 + (above - elevation) / (above - static_cast<double>(altitude[below]));

    const auto nearest =
        static_cast<std::size_t>(std::clamp(std::lround(row), 0L, static_cast<long>(altitude.size()) - 1));
    const double encoder = std::atan2(p.y(), p.x()) + static_cast<double>(sensor_.azimuth_offset_rad[nearest]);
    const double width = sensor_.width;
    const double measurement = wrapped(width * (1.0 - encoder / (2.0 * std::numbers::pi)), width);
    return {row, wrapped(measurement + sensor_.pixel_shift[nearest], width), measurement};
}

cv::Point2d ImageProjection::pixel_of(const Eigen::Vector3d& p, const Eigen::Vector3d& velocity) const {
    const double stamp_s = static_cast<double>(frame_.header.stamp_ns) * 1e-9;
    Beam beam{};
    double early_s = 0.0;
    for (int i = 0; i < kIterations; ++i) {
        const Eigen::Isometry3d T_world_sensor = interpolate(trajectory_, stamp_s - early_s);
        beam = beam_of(T_world_sensor.inverse() * (p - early_s * velocity));
        const auto column = static_cast<std::size_t>(beam.measurement) % frame_.columns.time_ns.size();
        const std::int64_t fired_ns = frame_.columns.time_ns[column];
        if (fired_ns != 0) early_s = static_cast<double>(frame_.header.stamp_ns - fired_ns) * 1e-9;
    }
    return {beam.column, beam.row};
}

std::vector<std::vector<cv::Point2d>> ImageProjection::edges_of(const OrientedBox& box,
                                                                const Eigen::Vector3d& velocity) const {
    std::array<Eigen::Vector3d, 8> corners;
    const Eigen::AngleAxisd turn(box.yaw_rad, Eigen::Vector3d::UnitZ());
    for (unsigned i = 0; i < 8; ++i) {
        const Eigen::Vector3d half = 0.5 * box.size_m;
        corners[i] = box.center_m + turn * Eigen::Vector3d((i & 1U) != 0 ? half.x() : -half.x(),
                                                           (i & 2U) != 0 ? half.y() : -half.y(),
                                                           (i & 4U) != 0 ? half.z() : -half.z());
    }
    std::vector<std::vector<cv::Point2d>> edges;
    for (unsigned i = 0; i < 8; ++i) {
        for (unsigned bit = 1; bit < 8; bit *= 2) {
            if ((i & bit) != 0) continue;
            auto& edge = edges.emplace_back();
            for (int k = 0; k <= kPixelsPerEdge; ++k) {
                const double s = static_cast<double>(k) / kPixelsPerEdge;
                edge.push_back(pixel_of((1.0 - s) * corners[i] + s * corners[i | bit], velocity));
            }
        }
    }
    return edges;
}

}  // namespace dlod::tools
