#include "core/segmentation/range_image_segmentation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

DLOD_MULTIVERSION void select_row(int width, const float* __restrict range, const std::uint8_t* __restrict ground,
                                  float min_range, float max_range, float* __restrict selected,
                                  std::uint8_t* __restrict used) {
    for (int c = 0; c < width; ++c) {
        const bool use = (ground[c] == 0) & (range[c] >= min_range) & (range[c] <= max_range);
        selected[c] = use ? range[c] : 0.0F;
        used[c] = use ? 1 : 0;
    }
}

/// The angle criterion between corresponding pixels of a and b: far <= ratio * near, which is beta >= theta (see
/// ratio_of).
DLOD_MULTIVERSION void connect_row(int width, const float* __restrict a, const float* __restrict b, float ratio,
                                   float max_step, std::uint8_t* __restrict connected) {
    for (int c = 0; c < width; ++c) {
        const float near = a[c] < b[c] ? a[c] : b[c];
        const float far = a[c] < b[c] ? b[c] : a[c];
        connected[c] = ((near > 0.0F) & (far <= ratio * near) & (far - near <= max_step)) ? 1 : 0;
    }
}

/// Bogoslavskyi's beta = atan2(near sin(alpha), far - near cos(alpha)) > theta, solved for far / near.
float ratio_of(double alpha_rad, double theta_rad) {
    return static_cast<float>(std::cos(alpha_rad) + std::sin(alpha_rad) / std::tan(theta_rad));
}

constexpr std::size_t kBoundsStep = 4;

}  // namespace

void RangeImageSegmentation::Bounds::include(const StructuredCloud& cloud, std::size_t pixel) {
    const float x = cloud.x[pixel], y = cloud.y[pixel];
    const float point[5] = {x, y, cloud.z[pixel], x + y, x - y};
    for (int i = 0; i < 5; ++i) {
        low[i] = point[i] < low[i] ? point[i] : low[i];
        high[i] = point[i] > high[i] ? point[i] : high[i];
    }
    range = std::max(range, cloud.range_m[pixel]);
}

float RangeImageSegmentation::Bounds::length() const {
    const auto extent = [this](int i) { return high[i] - low[i]; };
    return std::max(std::max(extent(0), extent(1)),
                    std::numbers::sqrt2_v<float> / 2.0F * std::max(extent(3), extent(4)));
}

RangeImageSegmentation::RangeImageSegmentation(const SensorModel& sensor, const SegmentationConfig& config)
    : sensor_(sensor),
      config_(config),
      ratio_right_(ratio_of(2.0 * std::numbers::pi / sensor.width, config.angle_threshold_rad)),
      range_(sensor.height, sensor.width) {
    const auto width = static_cast<std::size_t>(sensor.width);
    for (std::size_t r = 0; r + 1 < static_cast<std::size_t>(sensor.height); ++r) {
        const double alpha =
            std::abs(static_cast<double>(sensor.altitude_rad[r]) - static_cast<double>(sensor.altitude_rad[r + 1]));
        ratio_down_.push_back(ratio_of(alpha, config.angle_threshold_rad));
    }
    right_.assign(width, 0);
    down_.assign(width, 0);
    used_.assign(width, 0);
    runs_.reserve(sensor.pixels());
    points_.reserve(sensor.pixels());
    next_pixel_.reserve(4096);
    last_row_.reserve(4096);
    bounds_.reserve(4096);
}

std::uint32_t RangeImageSegmentation::find(std::uint32_t run) {
    while (runs_[run].parent != run) {
        runs_[run].parent = runs_[runs_[run].parent].parent;
        run = runs_[run].parent;
    }
    return run;
}

void RangeImageSegmentation::unite(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    if (a == b) return;
    if (b < a) std::swap(a, b);
    runs_[b].parent = a;
}

void RangeImageSegmentation::connect(const Frame& frame) {
    const int width = sensor_.width;
    const auto max_step = static_cast<float>(config_.max_depth_step_m);
    runs_.clear();
    std::uint32_t above_begin = 0;
    for (int r = 0; r < sensor_.height; ++r) {
        float* range = range_.row(r);
        select_row(width, frame.cloud.range_m.row(r), frame.prepared.ground.row(r),
                   static_cast<float>(config_.min_range_m), static_cast<float>(config_.max_range_m), range,
                   used_.data());
        connect_row(width - 1, range, range + 1, ratio_right_, max_step, right_.data());
        connect_row(1, range + width - 1, range, ratio_right_, max_step, right_.data() + width - 1);
        const auto row_begin = static_cast<std::uint32_t>(runs_.size());
        find_runs(r);
        const auto row_end = static_cast<std::uint32_t>(runs_.size());
        if (right_.back() != 0) unite(row_begin, row_end - 1);
        if (r > 0) {
            connect_row(width, range_.row(r - 1), range, ratio_down_[static_cast<std::size_t>(r - 1)], max_step,
                        down_.data());
            unite_rows(above_begin, row_begin, row_end);
        }
        above_begin = row_begin;
    }
}

void RangeImageSegmentation::find_runs(int row) {
    const auto width = static_cast<std::size_t>(sensor_.width);
    const auto first_of = [](const std::uint8_t* begin, std::uint8_t value, std::size_t n) {
        const void* found = std::memchr(begin, value, n);
        return found != nullptr ? static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - begin) : n;
    };
    for (std::size_t c = 0; c < width; ++c) {
        c += first_of(&used_[c], 1, width - c);
        if (c == width) return;
        const std::size_t last = std::min(c + first_of(&right_[c], 0, width - c), width - 1);
        runs_.push_back({static_cast<std::uint32_t>(runs_.size()), 0, static_cast<std::uint16_t>(row),
                         static_cast<std::uint16_t>(c), static_cast<std::uint16_t>(last)});
        c = last;
    }
}

void RangeImageSegmentation::unite_rows(std::uint32_t above, std::uint32_t here, std::uint32_t end) {
    const std::uint32_t above_end = here;
    while (above < above_end && here < end) {
        const Run& a = runs_[above];
        const Run& b = runs_[here];
        const std::uint16_t first = std::max(a.first, b.first);
        const std::uint16_t last = std::min(a.last, b.last);
        if (first <= last && std::memchr(&down_[first], 1, static_cast<std::size_t>(last - first) + 1) != nullptr) {
            unite(above, here);
        }
        if (runs_[above].last < runs_[here].last) {
            ++above;
        } else {
            ++here;
        }
    }
}

void RangeImageSegmentation::collect(Preparation& prepared, const StructuredCloud& cloud) {
    points_.assign(runs_.size(), 0);
    for (std::uint32_t i = 0; i < runs_.size(); ++i) {
        runs_[i].parent = find(i);
        points_[runs_[i].parent] += static_cast<std::uint32_t>(runs_[i].last - runs_[i].first) + 1U;
    }
    prepared.segments.clear();
    prepared.segment.fill(0);
    next_pixel_.clear();
    std::uint32_t pixels = 0;
    for (std::uint32_t i = 0; i < runs_.size(); ++i) {
        if (runs_[i].parent != i || points_[i] < static_cast<std::uint32_t>(config_.min_points)) continue;
        Segment& segment = prepared.segments.emplace_back();
        segment.first = pixels;
        segment.count = points_[i];
        runs_[i].segment = static_cast<std::uint32_t>(prepared.segments.size());
        next_pixel_.push_back(pixels);
        pixels += points_[i];
    }
    prepared.pixels.resize(pixels);
    // Runs come in row order: a segment's row is new where it differs from its last one.
    last_row_.assign(prepared.segments.size(), ~0U);
    bounds_.assign(prepared.segments.size(), {});
    for (const Run& run : runs_) {
        const std::uint32_t label = runs_[run.parent].segment;
        if (label == 0) continue;
        Segment& segment = prepared.segments[label - 1];
        if (last_row_[label - 1] != run.row) {
            last_row_[label - 1] = run.row;
            ++segment.rows;
        }
        const std::size_t begin = static_cast<std::size_t>(run.row) * static_cast<std::size_t>(sensor_.width);
        std::uint32_t next = next_pixel_[label - 1];
        const std::size_t end = begin + run.last + 1;
        for (std::size_t p = begin + run.first; p < end; ++p) {
            prepared.segment[p] = label;
            prepared.pixels[next++] = static_cast<PixelIndex>(p);
        }
        // Bounds from both ends of the run and every few pixels between: the cost counts, the millimetres do not.
        Bounds& bounds = bounds_[label - 1];
        for (std::size_t p = begin + run.first; p < end; p += kBoundsStep) bounds.include(cloud, p);
        bounds.include(cloud, end - 1);
        next_pixel_[label - 1] = next;
    }
    for (std::size_t i = 0; i < prepared.segments.size(); ++i) {
        Segment& segment = prepared.segments[i];
        const Bounds& bounds = bounds_[i];
        segment.min_m = {bounds.low[0], bounds.low[1], bounds.low[2]};
        segment.max_m = {bounds.high[0], bounds.high[1], bounds.high[2]};
        segment.length_m = bounds.length();
        segment.max_range_m = bounds.range;
        segment.feasible = is_feasible(segment, config_.feasibility);
    }
}

void RangeImageSegmentation::process(Frame& frame) {
    connect(frame);
    collect(frame.prepared, frame.cloud);
}

}  // namespace dlod
