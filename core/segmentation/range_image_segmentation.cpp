#include "core/segmentation/range_image_segmentation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr std::size_t kWord = 64;
constexpr std::size_t kBoundsStep = 4;

DLOD_MULTIVERSION_512 void select_row(int width, const float* __restrict range, const std::uint8_t* __restrict ground,
                                      float min_range, float max_range, float* __restrict selected) {
    for (int c = 0; c < width; ++c) {
        const bool use = (ground[c] == 0) & (range[c] >= min_range) & (range[c] <= max_range);
        selected[c] = use ? range[c] : 0.0F;
    }
}

/// Lists the columns of the bits that are set. @return how many there are
DLOD_MULTIVERSION std::uint32_t list_columns(std::size_t words, const std::uint64_t* __restrict bits,
                                             std::uint16_t* __restrict columns) {
    std::uint32_t n = 0;
    for (std::size_t w = 0; w < words; ++w) {
        for (std::uint64_t left = bits[w]; left != 0; left &= left - 1)
            columns[n++] = static_cast<std::uint16_t>(kWord * w + static_cast<std::size_t>(std::countr_zero(left)));
    }
    return n;
}

/// Union-find over runs: the root of a component is its first run. Halves the way on the way.
inline std::uint32_t find(std::uint32_t* parent, std::uint32_t run) {
    while (parent[run] != run) {
        parent[run] = parent[parent[run]];
        run = parent[run];
    }
    return run;
}

inline void unite(std::uint32_t* parent, std::uint32_t a, std::uint32_t b) {
    a = find(parent, a);
    b = find(parent, b);
    parent[a < b ? b : a] = a < b ? a : b;
}

/// Unites runs of a row, which are counted from `here` on, with those of the row above, counted from `above` on.
DLOD_MULTIVERSION void unite_rows(std::size_t words, const std::uint64_t* __restrict joins,
                                  const std::uint64_t* __restrict begins, const std::uint64_t* __restrict begins_above,
                                  std::uint32_t here, std::uint32_t above, std::uint32_t* __restrict parent) {
    const auto count = [](std::uint64_t bits) { return static_cast<std::uint32_t>(std::popcount(bits)); };
    for (std::size_t w = 0; w < words; ++w) {
        for (std::uint64_t left = joins[w]; left != 0; left &= left - 1) {
            const std::uint64_t up_to_column = left ^ (left - 1);
            unite(parent, above + count(begins_above[w] & up_to_column) - 1,
                  here + count(begins[w] & up_to_column) - 1);
        }
        here += count(begins[w]);
        above += count(begins_above[w]);
    }
}

/// Bogoslavskyi's beta = atan2(near sin(alpha), far - near cos(alpha)) > theta, solved for far / near.
float ratio_of(double alpha_rad, double theta_rad) {
    return static_cast<float>(std::cos(alpha_rad) + std::sin(alpha_rad) / std::tan(theta_rad));
}

}  // namespace

float RangeImageSegmentation::Bounds::length() const {
    return std::max(std::max(high[0] - low[0], high[1] - low[1]),
                    std::numbers::sqrt2_v<float> / 2.0F *
                        std::max(high_diagonal[0] + high_diagonal[2], high_diagonal[1] + high_diagonal[3]));
}

RangeImageSegmentation::RangeImageSegmentation(const SensorModel& sensor, const SegmentationConfig& config)
    : sensor_(sensor),
      config_(config),
      ratio_right_(ratio_of(sensor.column_rad(), config.angle_threshold_rad)),
      links_(sensor.width) {
    ratio_down_.push_back(1.0F);  // there is no row above the first
    for (std::size_t r = 1; r < static_cast<std::size_t>(sensor.height); ++r) {
        const double alpha =
            std::abs(static_cast<double>(sensor.altitude_rad[r - 1]) - static_cast<double>(sensor.altitude_rad[r]));
        ratio_down_.push_back(ratio_of(alpha, config.angle_threshold_rad));
    }
    row_begin_.assign(static_cast<std::size_t>(sensor.height) + 1, 0);
    for (auto* v : {&first_, &last_}) v->assign(sensor.pixels(), 0);
    for (auto* v : {&parent_, &label_, &points_}) v->assign(sensor.pixels(), 0);
    growing_.reserve(4096);
}

void RangeImageSegmentation::connect(const Frame& frame) {
    const auto max_step = static_cast<float>(config_.max_depth_step_m);
    const std::size_t words = links_.begins().size();
    std::uint32_t runs = 0;
    links_.begin();
    for (int r = 0; r < sensor_.height; ++r) {
        select_row(sensor_.width, frame.cloud.range_m.row(r), frame.prepared.ground.row(r),
                   static_cast<float>(config_.min_range_m), static_cast<float>(config_.max_range_m), links_.next_row());
        const auto row = static_cast<std::size_t>(r);
        links_.advance(ratio_right_, ratio_down_[row], max_step);
        const std::uint32_t row_begin = runs;
        runs += list_columns(words, links_.begins().data(), first_.data() + row_begin);
        list_columns(words, links_.ends().data(), last_.data() + row_begin);
        std::iota(parent_.data() + row_begin, parent_.data() + runs, row_begin);
        row_begin_[row] = row_begin;
        row_begin_[row + 1] = runs;
        if (links_.wraps()) unite(parent_.data(), row_begin, runs - 1);
        unite_rows(words, links_.joins().data(), links_.begins().data(), links_.begins_above().data(), row_begin,
                   row_begin_[row - (r > 0 ? 1 : 0)], parent_.data());
    }
}

void RangeImageSegmentation::number_segments(Preparation& prepared) {
    const std::uint32_t runs = row_begin_.back();
    std::fill_n(points_.begin(), runs, 0U);
    for (std::uint32_t i = 0; i < runs; ++i) {
        parent_[i] = parent_[parent_[i]];  // the root: that of an earlier run is known
        points_[parent_[i]] += static_cast<std::uint32_t>(last_[i] - first_[i]) + 1U;
    }
    prepared.segments.clear();
    std::uint32_t pixels = 0;
    for (std::uint32_t i = 0; i < runs; ++i) {
        label_[i] = label_[parent_[i]];
        if (parent_[i] != i) continue;
        label_[i] = 0;
        if (points_[i] < static_cast<std::uint32_t>(config_.min_points)) continue;
        Segment& segment = prepared.segments.emplace_back();
        segment.first = pixels;
        segment.count = points_[i];
        label_[i] = static_cast<std::uint32_t>(prepared.segments.size());
        pixels += points_[i];
    }
    prepared.pixels.resize(pixels);
}

void RangeImageSegmentation::collect(Preparation& prepared, const StructuredCloud& cloud) {
    const auto include = [&cloud](Bounds& bounds, std::size_t pixel) {
        const float x = cloud.x[pixel], y = cloud.y[pixel];
        const Eigen::Array4f point(x, y, cloud.z[pixel], cloud.range_m[pixel]);
        bounds.low = bounds.low.min(point);
        bounds.high = bounds.high.max(point);
        bounds.high_diagonal = bounds.high_diagonal.max(Eigen::Array4f(x, x, -x, -x) + Eigen::Array4f(y, -y, -y, y));
    };
    growing_.assign(prepared.segments.size(), {});
    for (std::size_t s = 0; s < growing_.size(); ++s) growing_[s].next_pixel = prepared.segments[s].first;
    for (int r = 0; r < sensor_.height; ++r) {
        std::uint32_t* labels = prepared.segment.row(r);
        std::size_t written = 0;
        const auto begin = static_cast<std::size_t>(r) * static_cast<std::size_t>(sensor_.width);
        const auto row = static_cast<std::size_t>(r);
        for (std::uint32_t i = row_begin_[row]; i < row_begin_[row + 1]; ++i) {
            const std::uint32_t label = label_[i];
            if (label == 0) continue;
            Growing& segment = growing_[label - 1];
            if (segment.last_row != r) {
                segment.last_row = r;
                ++segment.rows;
            }
            const std::size_t count = static_cast<std::size_t>(last_[i] - first_[i]) + 1;
            std::fill(labels + written, labels + first_[i], 0U);
            std::fill_n(labels + first_[i], count, label);
            written = static_cast<std::size_t>(last_[i]) + 1;
            PixelIndex* pixels = &prepared.pixels[segment.next_pixel];
            std::iota(pixels, pixels + count, static_cast<PixelIndex>(begin + first_[i]));
            segment.next_pixel += static_cast<std::uint32_t>(count);
            if (segment.too_large) continue;
            // Both ends and every few pixels between: the cost counts, the millimetres do not.
            const std::size_t last = last_[i];
            for (std::size_t c = first_[i]; c < last + kBoundsStep; c += kBoundsStep)
                include(segment.bounds, begin + std::min(c, last));
            segment.too_large = is_too_large(segment.bounds.height(), segment.bounds.length(), segment.bounds.high[3],
                                             config_.feasibility);
        }
        std::fill(labels + written, labels + sensor_.width, 0U);
    }
    for (std::size_t s = 0; s < growing_.size(); ++s) {
        Segment& segment = prepared.segments[s];
        const Bounds& bounds = growing_[s].bounds;
        segment.rows = growing_[s].rows;
        segment.min_m = bounds.low.head<3>();
        segment.max_m = bounds.high.head<3>();
        segment.length_m = bounds.length();
        segment.max_range_m = bounds.high[3];
        segment.feasible = is_feasible(segment, config_.feasibility);
    }
}

void RangeImageSegmentation::process(Frame& frame) {
    connect(frame);
    number_segments(frame.prepared);
    collect(frame.prepared, frame.cloud);
}

}  // namespace dlod
