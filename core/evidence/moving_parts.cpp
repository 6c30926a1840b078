#include "core/evidence/moving_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace dlod {
namespace {

constexpr int kMaxWindow = 24;  // pixels to each side that are tested around a free one

/// Longest extent in the ground plane, along two axes of the sensor.
double breadth_m(const OdometryResult& odometry, std::span<const PixelIndex> pixels) {
    Eigen::Array2f low = Eigen::Array2f::Constant(1e9F), high = -low;
    for (const PixelIndex p : pixels) {
        const Eigen::Array2f q(odometry.x[p], odometry.y[p]);
        low = low.min(q);
        high = high.max(q);
    }
    return static_cast<double>((high - low).maxCoeff());
}

}  // namespace

MovingParts::MovingParts(const SensorModel& sensor, const MovingPartsConfig& config)
    : sensor_(sensor), config_(config), state_(sensor.height, sensor.width, kFresh) {
    part_.reserve(sensor.pixels());
    away_m_.reserve(sensor.pixels());
}

void MovingParts::request_around(const Frame& frame, const Segment& segment, EvidenceImage& evidence) const {
    const double column_rad = sensor_.column_rad();
    const double row_rad = sensor_.row_rad();
    const std::uint32_t label = frame.prepared.segment[frame.prepared.pixels[segment.first]];
    const int width = sensor_.width;
    struct Window {
        int row = -1, column = 0, rows = 0, columns = 0;
    } last;
    for (const PixelIndex pixel : pixels_of(frame, segment)) {
        if (evidence[pixel] != Evidence::kFree) continue;
        const double reach_rad = config_.reach_m / std::max(0.5, static_cast<double>(frame.cloud.range_m[pixel]));
        const int columns = std::clamp(static_cast<int>(reach_rad / column_rad), 2, kMaxWindow);
        const int rows = std::clamp(static_cast<int>(reach_rad / row_rad), 2, kMaxWindow);
        const int row = static_cast<int>(pixel) / width;
        const int column = static_cast<int>(pixel) % width;
        int from = column - columns;
        const int to = column + columns;
        // The windows of a row overlap: what the last one has asked for need not be looked at again.
        if (row == last.row && rows <= last.rows && from >= last.column - last.columns)
            from = std::max(from, last.column + last.columns + 1);
        if (from > to) continue;
        last = {row, column, rows, columns};
        for (int r = std::max(0, row - rows); r <= std::min(sensor_.height - 1, row + rows); ++r) {
            int c = from < 0 ? from + width : from < width ? from : from - width;
            for (int k = from; k <= to; ++k) {
                const auto p = static_cast<PixelIndex>(r * width + c);
                if (frame.prepared.segment[p] == label) evidence.request(p);
                if (++c == width) c = 0;
            }
        }
    }
}

bool MovingParts::grow(const Frame& frame, const Segment& segment, const EvidenceImage& evidence, PixelIndex seed) {
    const std::uint32_t label = frame.prepared.segment[frame.prepared.pixels[segment.first]];
    const auto& odometry = frame.odometry;
    const auto reach = static_cast<float>(config_.reach_m);
    const auto width = static_cast<PixelIndex>(sensor_.width);
    const auto size = static_cast<PixelIndex>(sensor_.pixels());
    part_.clear();
    away_m_.clear();
    part_.push_back(seed);
    away_m_.push_back(0.0F);
    state_[seed] = kVisited;
    std::size_t free = 0;
    for (std::size_t next = 0; next < part_.size(); ++next) {
        const PixelIndex p = part_[next];
        if (evidence[p] == Evidence::kFree) {
            away_m_[next] = 0.0F;
            ++free;
        }
        const PixelIndex column = p % width;
        const std::array<PixelIndex, 4> neighbours{p - width, p + width, column == 0 ? p + width - 1 : p - 1,
                                                   column + 1 == width ? p + 1 - width : p + 1};
        for (const PixelIndex q : neighbours) {
            if (q >= size || state_[q] != kFresh || frame.prepared.segment[q] != label || evidence.was_occupied(q))
                continue;
            const float step = Eigen::Vector3f(odometry.x[q] - odometry.x[p], odometry.y[q] - odometry.y[p],
                                               odometry.z[q] - odometry.z[p])
                                   .norm();
            const float away = evidence[q] == Evidence::kFree ? 0.0F : away_m_[next] + step;
            if (away > reach) continue;
            state_[q] = kVisited;
            part_.push_back(q);
            away_m_.push_back(away);
        }
    }
    const bool carved = segment.count > static_cast<std::uint32_t>(config_.small_segment);
    const double min_height = carved ? config_.min_carved_height_m : config_.min_height_m;
    const auto [low, high] = std::minmax_element(
        part_.begin(), part_.end(), [&](PixelIndex a, PixelIndex b) { return odometry.z[a] < odometry.z[b]; });
    if (static_cast<double>(odometry.z[*high] - odometry.z[*low]) < min_height) return false;
    if (carved && breadth_m(odometry, part_) < config_.min_carved_breadth_m) return false;
    return part_.size() >= static_cast<std::size_t>(config_.min_points) &&
           static_cast<double>(free) >= config_.min_free_share * static_cast<double>(part_.size());
}

}  // namespace dlod
