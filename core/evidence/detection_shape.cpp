#include "core/evidence/detection_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dlod {

void measure_shape(std::span<const PixelIndex> pixels, const OdometryResult& odometry, Detection& detection) {
    if (pixels.empty()) return;
    const Eigen::Matrix3d R = odometry.T_world_sensor.linear();
    const Eigen::Vector3d t = odometry.T_world_sensor.translation();
    const auto point = [&](PixelIndex p) {
        return Eigen::Vector3d(R * Eigen::Vector3d(static_cast<double>(odometry.x[p]),
                                                   static_cast<double>(odometry.y[p]),
                                                   static_cast<double>(odometry.z[p])));
    };
    const Eigen::Vector3d origin = point(pixels.front());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    for (const PixelIndex p : pixels) {
        const Eigen::Vector3d d = point(p) - origin;
        sum += d;
        xx += d.x() * d.x();
        xy += d.x() * d.y();
        yy += d.y() * d.y();
    }
    const auto n = static_cast<double>(pixels.size());
    const Eigen::Vector3d mean = sum / n;
    xx = xx / n - mean.x() * mean.x();
    xy = xy / n - mean.x() * mean.y();
    yy = yy / n - mean.y() * mean.y();
    const double yaw = 0.5 * std::atan2(2.0 * xy, xx - yy);
    const double c = std::cos(yaw);
    const double s = std::sin(yaw);
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
    Eigen::Vector3d high = -low;
    for (const PixelIndex p : pixels) {
        const Eigen::Vector3d d = point(p) - origin;
        const Eigen::Vector3d along(c * d.x() + s * d.y(), -s * d.x() + c * d.y(), d.z());
        low = low.cwiseMin(along);
        high = high.cwiseMax(along);
    }
    const Eigen::Vector3d middle = 0.5 * (low + high);
    detection.centroid_m = origin + mean + t;
    detection.height_m = high.z() - low.z();
    detection.box.yaw_rad = yaw;
    detection.box.size_m = high - low;
    detection.box.center_m =
        origin + t + Eigen::Vector3d(c * middle.x() - s * middle.y(), s * middle.x() + c * middle.y(), middle.z());
}

void mark_occlusion(std::span<const PixelIndex> pixels, const Image<float>& range_m, double min_step_m,
                    std::span<int> row_ends, Detection& detection) {
    detection.occluded_left = false;
    detection.occluded_right = false;
    if (pixels.empty()) return;
    const int width = range_m.width();
    const int height = range_m.height();
    // Columns relative to the first pixel, so that the image's seam does not matter.
    const int reference = static_cast<int>(pixels.front()) % width;
    std::span<int> left = row_ends.first(static_cast<std::size_t>(height));
    std::span<int> right = row_ends.subspan(static_cast<std::size_t>(height), static_cast<std::size_t>(height));
    int top = height;
    int bottom = -1;
    for (const PixelIndex p : pixels) {
        const int row = static_cast<int>(p) / width;
        top = std::min(top, row);
        bottom = std::max(bottom, row);
    }
    for (int r = top; r <= bottom; ++r) {
        left[static_cast<std::size_t>(r)] = width;
        right[static_cast<std::size_t>(r)] = -width;
    }
    for (const PixelIndex p : pixels) {
        const auto row = static_cast<std::size_t>(static_cast<int>(p) / width);
        int column = static_cast<int>(p) % width - reference;
        if (column >= width / 2) column -= width;
        if (column < -width / 2) column += width;
        left[row] = std::min(left[row], column);
        right[row] = std::max(right[row], column);
    }
    constexpr int kReach = 3;  // columns beyond the end in which the neighbour's return is looked for
    const auto step = static_cast<float>(min_step_m);
    const auto wrapped = [&](int column) { return ((column + reference) % width + width) % width; };
    const auto nearer_beyond = [&](int row, int end, int direction) {
        const float own = range_m(row, wrapped(end));
        for (int i = 1; i <= kReach; ++i) {
            const float beyond = range_m(row, wrapped(end + direction * i));
            if (beyond > 0.0F) return beyond < own - step;
        }
        return false;
    };
    int rows = 0;
    int hidden_left = 0;
    int hidden_right = 0;
    for (int r = top; r <= bottom; ++r) {
        const auto row = static_cast<std::size_t>(r);
        if (right[row] < left[row]) continue;
        ++rows;
        hidden_left += nearer_beyond(r, left[row], -1) ? 1 : 0;
        hidden_right += nearer_beyond(r, right[row], 1) ? 1 : 0;
    }
    detection.occluded_left = 2 * hidden_left >= rows;
    detection.occluded_right = 2 * hidden_right >= rows;
}

}  // namespace dlod
