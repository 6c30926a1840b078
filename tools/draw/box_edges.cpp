#include "tools/draw/box_edges.hpp"

#include <array>
#include <optional>

#include "core/projection/sweep_projection.hpp"

namespace dlod::tools {
namespace {

constexpr int kPointsPerEdge = 24;

/// The object is where it is seen after one correction: the second would move it by less than a pixel.
std::optional<Pixel> pixel_of(const Eigen::Vector3d& p, const Eigen::Vector3d& velocity_mps,
                              const SweepProjection& projection, const SensorModel& sensor, const Frame& frame) {
    const auto at_stamp = projection.project(p);
    if (!at_stamp) return std::nullopt;
    const int measurement = sensor.measurement_of(at_stamp->pixel.row, at_stamp->pixel.column);
    const std::int64_t fired_ns = frame.columns.time_ns[static_cast<std::size_t>(measurement)];
    if (fired_ns == 0) return at_stamp->pixel;  // a lost column
    const double early_s = 1e-9 * static_cast<double>(frame.header.stamp_ns - fired_ns);
    const auto when_fired = projection.project(p - early_s * velocity_mps);
    return when_fired ? std::optional(when_fired->pixel) : std::nullopt;
}

}  // namespace

std::vector<std::vector<cv::Point>> box_edges(const Track& track, const SensorModel& sensor, const Frame& frame) {
    SweepProjection projection(sensor);
    projection.set(frame.odometry);
    const Eigen::AngleAxisd turn(track.box.yaw_rad, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d half = 0.5 * track.box.size_m;
    std::array<Eigen::Vector3d, 8> corners;  // bit 0: front, bit 1: left, bit 2: top
    for (unsigned i = 0; i < 8; ++i) {
        const auto side = [&](unsigned bit, double extent) { return (i & bit) != 0 ? extent : -extent; };
        corners[i] =
            track.box.center_m + turn * Eigen::Vector3d(side(1, half.x()), side(2, half.y()), side(4, half.z()));
    }
    std::vector<std::vector<cv::Point>> edges;
    for (unsigned i = 0; i < 8; ++i) {
        for (unsigned bit = 1; bit < 8; bit *= 2) {
            if ((i & bit) != 0) continue;
            edges.emplace_back();
            for (int k = 0; k <= kPointsPerEdge; ++k) {
                const double s = static_cast<double>(k) / kPointsPerEdge;
                const auto pixel = pixel_of((1.0 - s) * corners[i] + s * corners[i | bit], track.velocity_mps,
                                            projection, sensor, frame);
                if (pixel) {
                    edges.back().emplace_back(pixel->column, pixel->row);
                } else if (!edges.back().empty()) {
                    edges.emplace_back();
                }
            }
        }
    }
    return edges;
}

}  // namespace dlod::tools
