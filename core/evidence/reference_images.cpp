#include "core/evidence/reference_images.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr int kNarrowRows = 1;  // rows of a window above and below its cell
constexpr int kWideRows = 2;
constexpr double kNarrowCell_rad = 0.0062;  // one column of 1024: the window covers three
constexpr int kWiderBits = 2;               // wide cells have so many bits more
constexpr std::uint16_t kNone = 65535;      // a missing return in a minimum

DLOD_MULTIVERSION void quantize(int n, const float* __restrict range_m, std::uint16_t* __restrict units) {
    for (int i = 0; i < n; ++i) {
        const float u = range_m[i] * (1.0F / kReferenceUnit_m);
        units[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(u < 65000.0F ? u : 0.0F));
    }
}

DLOD_MULTIVERSION void start_column(int n, const std::uint16_t* __restrict units, std::uint16_t* __restrict low,
                                    std::uint16_t* __restrict high, std::uint16_t* __restrict missing) {
    for (int i = 0; i < n; ++i) {
        low[i] = units[i] == 0 ? kNone : units[i];
        high[i] = units[i];
        missing[i] = units[i] == 0 ? 1 : 0;
    }
}

DLOD_MULTIVERSION void extend_column(int n, const std::uint16_t* __restrict units, std::uint16_t* __restrict low,
                                     std::uint16_t* __restrict high, std::uint16_t* __restrict missing) {
    for (int i = 0; i < n; ++i) {
        const std::uint16_t near = units[i] == 0 ? kNone : units[i];
        low[i] = near < low[i] ? near : low[i];
        high[i] = units[i] > high[i] ? units[i] : high[i];
        missing[i] = static_cast<std::uint16_t>(missing[i] + (units[i] == 0 ? 1 : 0));
    }
}

/// Widens the windows' extremes by one more column each.
DLOD_MULTIVERSION void widen(int n, const std::uint16_t* __restrict column_low,
                             const std::uint16_t* __restrict column_high,
                             const std::uint16_t* __restrict column_missing, std::uint16_t* __restrict low,
                             std::uint16_t* __restrict high, std::uint16_t* __restrict missing) {
    for (int i = 0; i < n; ++i) {
        low[i] = column_low[i] < low[i] ? column_low[i] : low[i];
        high[i] = column_high[i] > high[i] ? column_high[i] : high[i];
        missing[i] = static_cast<std::uint16_t>(missing[i] + column_missing[i]);
    }
}

/// One cell of every `cell`-th window.
DLOD_MULTIVERSION void pack(int n, int cell, int most_missing, const std::uint16_t* __restrict low,
                            const std::uint16_t* __restrict high, const std::uint16_t* __restrict missing,
                            std::uint32_t* __restrict cells) {
    for (int i = 0; i < n; ++i) {
        const std::uint32_t packed = (static_cast<std::uint32_t>(high[i * cell]) << 16U) | low[i * cell];
        cells[i] = missing[i * cell] <= most_missing ? packed : 0U;
    }
}

}  // namespace

ReferenceImages::ReferenceImages(const SensorModel& sensor, int levels)
    : sensor_(sensor),
      levels_(levels),
      pool_(2 * static_cast<std::size_t>(levels) + 1),
      users_(pool_.size(), 0),
      slots_(2 * static_cast<std::size_t>(levels), -1),
      units_(sensor.height, sensor.width) {
    const double column_rad = 2.0 * std::numbers::pi / sensor.width;
    while (sensor.width % (2 << narrow_bits_) == 0 && (2 << narrow_bits_) * column_rad < 1.5 * kNarrowCell_rad)
        ++narrow_bits_;
    wide_bits_ = narrow_bits_;
    for (int i = 0; i < kWiderBits && sensor.width % (2 << wide_bits_) == 0; ++i) ++wide_bits_;
    double sum = 0.0;
    for (const int shift : sensor.pixel_shift) sum += shift;
    mean_shift_ = sum / std::max(1, sensor.height);
    for (Reference& reference : pool_) {
        reference.cells.assign((sensor.pixels() >> narrow_bits_) + (sensor.pixels() >> wide_bits_), 0);
        reference.T_block_stamp.assign(Reference::kBlocks, Eigen::Isometry3f::Identity());
        reference.T_block_stamp_late.assign(Reference::kBlocks, Eigen::Isometry3f::Identity());
        reference.column_shift.assign(1 + static_cast<std::size_t>(sensor.height), 0.0F);
    }
    const auto bordered = static_cast<std::size_t>(sensor.width + (4 << wide_bits_));
    low_.assign(bordered, 0);
    high_.assign(bordered, 0);
    missing_.assign(bordered, 0);
    for (auto* v : {&window_low_, &window_high_, &window_missing_})
        v->assign(static_cast<std::size_t>(sensor.width), 0);
    selected_.reserve(pool_.size());
}

void ReferenceImages::clear() {
    std::fill(slots_.begin(), slots_.end(), -1);
    std::fill(users_.begin(), users_.end(), 0);
    inserted_ = 0;
}

const Reference& ReferenceImages::insert(const Frame& frame) {
    std::size_t free = 0;
    while (users_[free] != 0) ++free;
    Reference& reference = pool_[free];
    fill_poses(frame, reference);
    fill_windows(frame.cloud, reference);
    reference.stamp_ns = frame.header.stamp_ns;
    for (int level = 0; level < levels_ && inserted_ % (std::uint64_t{1} << level) == 0; ++level) {
        int* latest = &slots_[2 * static_cast<std::size_t>(level)];
        if (latest[1] >= 0) --users_[static_cast<std::size_t>(latest[1])];
        latest[1] = latest[0];
        latest[0] = static_cast<int>(free);
        ++users_[free];
    }
    ++inserted_;
    return reference;
}

const std::vector<const Reference*>& ReferenceImages::select() {
    selected_.clear();
    const auto add = [this](int index) {
        if (index < 0) return;
        const Reference* reference = &pool_[static_cast<std::size_t>(index)];
        if (std::find(selected_.begin(), selected_.end(), reference) == selected_.end()) selected_.push_back(reference);
    };
    add(slots_[0]);
    // The earlier of a level's two is between one and two of its steps old.
    for (std::size_t level = 0; level < static_cast<std::size_t>(levels_); ++level) {
        add(slots_[2 * level + 1] >= 0 ? slots_[2 * level + 1] : slots_[2 * level]);
    }
    return selected_;
}

void ReferenceImages::fill_poses(const Frame& frame, Reference& reference) const {
    reference.T_world_sensor = frame.odometry.T_world_sensor;
    const auto width = static_cast<double>(sensor_.width);
    const auto deskew_at = [&](double measurement) {
        const auto m = static_cast<std::size_t>(std::clamp(measurement, 0.0, width - 1.0));
        Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
        for (int i = 0; i < 12; ++i) T.matrix()(i / 4, i % 4) = frame.odometry.deskew[i][m];
        return T;
    };
    for (std::size_t b = 0; b < Reference::kBlocks; ++b) {
        const double middle = (static_cast<double>(b) + 0.5) * width / Reference::kBlocks - mean_shift_;
        reference.T_block_stamp[b] = deskew_at(middle).inverse();
        reference.T_block_stamp_late[b] = deskew_at(middle + width).inverse();
    }
    // A row that is shifted less than the mean is fired later; meanwhile the sensor has turned on.
    const Eigen::Isometry3f first =
        sensor_.T_sensor_lidar.inverse().cast<float>() * deskew_at(0.0) * sensor_.T_sensor_lidar.cast<float>();
    const double turned_rad = -std::atan2(static_cast<double>(first(1, 0)), static_cast<double>(first(0, 0)));
    for (std::size_t r = 0; r < static_cast<std::size_t>(sensor_.height); ++r) {
        reference.column_shift[r + 1] = static_cast<float>((mean_shift_ - sensor_.pixel_shift[r]) / width * turned_rad *
                                                           width / (2.0 * std::numbers::pi));
    }
}

void ReferenceImages::fill_windows(const StructuredCloud& cloud, Reference& reference) {
    const int width = sensor_.width;
    const int height = sensor_.height;
    quantize(static_cast<int>(units_.size()), cloud.range_m.data(), units_.data());
    const auto fill = [&](int half_rows, int bits, std::uint32_t* cells) {
        const int cell = 1 << bits;
        const int border = std::max(1, cell / 2);
        const int most_missing = (2 * half_rows + 1) * (cell + 2 * border) / 3;
        std::uint16_t* low = low_.data() + border;
        std::uint16_t* high = high_.data() + border;
        std::uint16_t* missing = missing_.data() + border;
        for (int r = 0; r < height; ++r) {
            const int top = std::max(0, r - half_rows);
            const int bottom = std::min(height - 1, r + half_rows);
            start_column(width, units_.row(top), low, high, missing);
            for (int k = top + 1; k <= bottom; ++k) extend_column(width, units_.row(k), low, high, missing);
            for (auto* v : {low, high, missing}) {
                std::copy_n(v, border, v + width);
                std::copy_n(v + width - border, border, v - border);
            }
            std::copy_n(low - border, width, window_low_.data());
            std::copy_n(high - border, width, window_high_.data());
            std::copy_n(missing - border, width, window_missing_.data());
            for (int k = 1 - border; k < cell + border; ++k) {
                widen(width, low + k, high + k, missing + k, window_low_.data(), window_high_.data(),
                      window_missing_.data());
            }
            pack(width >> bits, cell, most_missing, window_low_.data(), window_high_.data(), window_missing_.data(),
                 cells);
            cells += width >> bits;
        }
    };
    fill(kNarrowRows, narrow_bits_, reference.cells.data());
    fill(kWideRows, wide_bits_, reference.cells.data() + (sensor_.pixels() >> narrow_bits_));
}

}  // namespace dlod
