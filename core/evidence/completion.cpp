#include "core/evidence/completion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>

namespace dlod {
namespace {

constexpr int kRowsBelow = 6;       // below the detection in which its ground is looked for
constexpr int kColumnsBeside = 10;  // beside it
constexpr double kGroundReach_m = 1.5;
constexpr std::size_t kFewestGroundPoints = 8;
constexpr double kOutlier_m = 0.04;  // feet among the ground points
constexpr double kFootStep_m = 0.2;
constexpr std::uint32_t kSplinter = 80;  // pixels: segments so small at the edge of an object belong to it

}  // namespace

Completion::Completion(const SensorModel& sensor, const CompletionConfig& config)
    : sensor_(sensor), config_(config), taken_(sensor.height, sensor.width, 0) {
    away_m_.reserve(sensor.pixels());
    ground_points_.reserve(4096);
}

Eigen::Vector3d Completion::world_point(const Frame& frame, PixelIndex pixel) const {
    const OdometryResult& odometry = frame.odometry;
    return odometry.T_world_sensor * Eigen::Vector3d(static_cast<double>(odometry.x[pixel]),
                                                     static_cast<double>(odometry.y[pixel]),
                                                     static_cast<double>(odometry.z[pixel]));
}

template <class Accept>
void Completion::grow(const Frame& frame, std::size_t first, double reach_m, std::vector<PixelIndex>& pixels,
                      Accept accept) {
    const OdometryResult& odometry = frame.odometry;
    const auto width = static_cast<PixelIndex>(sensor_.width);
    const auto size = static_cast<PixelIndex>(sensor_.pixels());
    away_m_.assign(pixels.size() - first, 0.0F);
    for (std::size_t next = first; next < pixels.size(); ++next) {
        const PixelIndex p = pixels[next];
        const PixelIndex column = p % width;
        const std::array<PixelIndex, 4> neighbours{p - width, p + width, column == 0 ? p + width - 1 : p - 1,
                                                   column + 1 == width ? p + 1 - width : p + 1};
        for (const PixelIndex q : neighbours) {
            if (q >= size || taken_[q] != 0 || frame.cloud.range_m[q] == 0.0F || !accept(q)) continue;
            const float step = Eigen::Vector3f(odometry.x[q] - odometry.x[p], odometry.y[q] - odometry.y[p],
                                               odometry.z[q] - odometry.z[p])
                                   .norm();
            const float away = away_m_[next - first] + step;
            if (static_cast<double>(away) > reach_m) continue;
            taken_[q] = 1;
            pixels.push_back(q);
            away_m_.push_back(away);
        }
    }
}

Completion::GroundPlane Completion::fit_ground(const Frame& frame, std::span<const PixelIndex> pixels) {
    GroundPlane plane;
    const int width = sensor_.width;
    int bottom = -1;
    for (const PixelIndex p : pixels) bottom = std::max(bottom, static_cast<int>(p) / width);
    // Columns of the lowest rows, relative to one of them for the seam.
    int reference = -1;
    int left = 0;
    int right = 0;
    PixelIndex foot = pixels.front();
    for (const PixelIndex p : pixels) {
        if (static_cast<int>(p) / width + 2 < bottom) continue;
        if (reference < 0) {
            reference = static_cast<int>(p) % width;
            foot = p;
        }
        int column = static_cast<int>(p) % width - reference;
        if (column > width / 2) column -= width;
        if (column < -width / 2) column += width;
        left = std::min(left, column);
        right = std::max(right, column);
    }
    plane.origin = world_point(frame, foot);
    ground_points_.clear();
    for (int r = std::max(0, bottom - 2); r <= std::min(sensor_.height - 1, bottom + kRowsBelow); ++r) {
        for (int dc = left - kColumnsBeside; dc <= right + kColumnsBeside; ++dc) {
            const int c = ((reference + dc) % width + width) % width;
            if (frame.prepared.ground(r, c) == 0) continue;
            const Eigen::Vector3d d = world_point(frame, static_cast<PixelIndex>(r * width + c)) - plane.origin;
            if (d.head<2>().squaredNorm() < kGroundReach_m * kGroundReach_m) ground_points_.push_back(d);
        }
    }
    // Twice: the second time without the feet that stand out of the first plane.
    double limit = 1e9;
    for (int round = 0; round < 2; ++round) {
        Eigen::Matrix3d A = Eigen::Matrix3d::Identity() * 1e-3;
        A(2, 2) = 1e-9;
        Eigen::Vector3d b = Eigen::Vector3d::Zero();
        std::size_t used = 0;
        for (const Eigen::Vector3d& d : ground_points_) {
            const Eigen::Vector3d row(d.x(), d.y(), 1.0);
            if (d.z() - row.dot(plane.coefficients) > limit) continue;
            A += row * row.transpose();
            b += row * d.z();
            ++used;
        }
        if (used < kFewestGroundPoints) return plane;
        plane.coefficients = A.ldlt().solve(b);
        limit = kOutlier_m;
    }
    plane.found = true;
    return plane;
}

void Completion::complete(const Frame& frame, const EvidenceImage& evidence, std::size_t first,
                          std::vector<PixelIndex>& pixels) {
    if (config_.fringe_m > 0.0) {
        grow(frame, first, config_.fringe_m, pixels, [&](PixelIndex q) {
            if (frame.prepared.ground[q] != 0 || evidence.was_occupied(q)) return false;
            const std::uint32_t segment = frame.prepared.segment[q];
            if (segment == 0 || evidence[q] == Evidence::kFree) return true;
            const Segment& other = frame.prepared.segments[segment - 1];
            return !other.feasible && other.count <= kSplinter;
        });
    }
    const GroundPlane plane = fit_ground(frame, std::span(pixels).subspan(first));
    if (!plane.found) return;
    grow(frame, first, kFootStep_m, pixels, [&](PixelIndex q) {
        if (frame.prepared.ground[q] == 0) return false;
        const Eigen::Vector3d d = world_point(frame, q) - plane.origin;
        const double height = d.z() - Eigen::Vector3d(d.x(), d.y(), 1.0).dot(plane.coefficients);
        return height > config_.foot_height_m && height < config_.max_foot_height_m;
    });
}

}  // namespace dlod
