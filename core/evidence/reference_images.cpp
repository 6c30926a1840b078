#include "core/evidence/reference_images.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr double kNarrowCell_rad = 0.0062;  // one column of 1024: the window covers three
constexpr int kWiderBits = 2;               // wide cells have so many bits more

DLOD_MULTIVERSION_512 void quantize(int n, const float* __restrict range_m, std::uint16_t* __restrict units) {
    for (int i = 0; i < n; ++i) {
        const float u = range_m[i] * (1.0F / kReferenceUnit_m);
        units[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(u < 65000.0F ? u : 0.0F));
    }
}

// Windows hold the least of (units - 1), where a missing return wraps to the largest number, the greatest of the units,
// and the number of missing returns.

DLOD_MULTIVERSION_512 void stack_rows(int n, const std::uint16_t* __restrict above,
                                      const std::uint16_t* __restrict here, const std::uint16_t* __restrict below,
                                      std::uint16_t* __restrict low, std::uint16_t* __restrict high,
                                      std::uint16_t* __restrict missing) {
    for (int i = 0; i < n; ++i) {
        const std::uint16_t a = above[i], b = here[i], c = below[i];
        const auto low_a = static_cast<std::uint16_t>(a - 1);
        const auto low_b = static_cast<std::uint16_t>(b - 1);
        const auto low_c = static_cast<std::uint16_t>(c - 1);
        const std::uint16_t low_ab = low_a < low_b ? low_a : low_b;
        low[i] = low_ab < low_c ? low_ab : low_c;
        const std::uint16_t high_ab = a > b ? a : b;
        high[i] = high_ab > c ? high_ab : c;
        missing[i] = static_cast<std::uint16_t>((a == 0) + (b == 0) + (c == 0));
    }
}

/// Joins the windows of two rows.
DLOD_MULTIVERSION_512 void join_rows(int n, const std::uint16_t* __restrict low_a,
                                     const std::uint16_t* __restrict low_b, const std::uint16_t* __restrict high_a,
                                     const std::uint16_t* __restrict high_b, const std::uint16_t* __restrict missing_a,
                                     const std::uint16_t* __restrict missing_b, std::uint16_t* __restrict low,
                                     std::uint16_t* __restrict high, std::uint16_t* __restrict missing) {
    for (int i = 0; i < n; ++i) {
        low[i] = low_a[i] < low_b[i] ? low_a[i] : low_b[i];
        high[i] = high_a[i] > high_b[i] ? high_a[i] : high_b[i];
        missing[i] = static_cast<std::uint16_t>(missing_a[i] + missing_b[i]);
    }
}

/// Joins each two neighbours: n windows from 2 n.
DLOD_MULTIVERSION_512 void halve(int n, const std::uint16_t* __restrict low_in, const std::uint16_t* __restrict high_in,
                                 const std::uint16_t* __restrict missing_in, std::uint16_t* __restrict low,
                                 std::uint16_t* __restrict high, std::uint16_t* __restrict missing) {
    for (int i = 0; i < n; ++i) {
        low[i] = low_in[2 * i] < low_in[2 * i + 1] ? low_in[2 * i] : low_in[2 * i + 1];
        high[i] = high_in[2 * i] > high_in[2 * i + 1] ? high_in[2 * i] : high_in[2 * i + 1];
        missing[i] = static_cast<std::uint16_t>(missing_in[2 * i] + missing_in[2 * i + 1]);
    }
}

inline std::uint16_t lesser(std::uint16_t a, std::uint16_t b) {
    return a < b ? a : b;
}

inline std::uint16_t greater(std::uint16_t a, std::uint16_t b) {
    return a > b ? a : b;
}

inline std::uint32_t pack(std::uint16_t low, std::uint16_t high, int missing, int most_missing) {
    const std::uint32_t packed = (static_cast<std::uint32_t>(high) << 16U) | static_cast<std::uint16_t>(low + 1);
    return missing <= most_missing ? packed : 0U;
}

/// Cells of one column: their windows are three wide.
DLOD_MULTIVERSION_512 void pack_columns(int n, int most_missing, const std::uint16_t* __restrict low,
                                        const std::uint16_t* __restrict high, const std::uint16_t* __restrict missing,
                                        std::uint32_t* __restrict cells) {
    for (int i = 0; i < n; ++i) {
        cells[i] =
            pack(lesser(lesser(low[i - 1], low[i]), low[i + 1]), greater(greater(high[i - 1], high[i]), high[i + 1]),
                 missing[i - 1] + missing[i] + missing[i + 1], most_missing);
    }
}

/// Cells of two units: their windows are four wide.
DLOD_MULTIVERSION_512 void pack_pairs(int n, int most_missing, const std::uint16_t* __restrict low,
                                      const std::uint16_t* __restrict high, const std::uint16_t* __restrict missing,
                                      std::uint32_t* __restrict cells) {
    for (int i = 0; i < n; ++i) {
        const int k = 2 * i;
        cells[i] = pack(lesser(lesser(low[k - 1], low[k]), lesser(low[k + 1], low[k + 2])),
                        greater(greater(high[k - 1], high[k]), greater(high[k + 1], high[k + 2])),
                        missing[k - 1] + missing[k] + missing[k + 1] + missing[k + 2], most_missing);
    }
}

}  // namespace

ReferenceImages::ReferenceImages(const SensorModel& sensor, int levels)
    : sensor_(sensor),
      levels_(levels),
      pool_(2 * static_cast<std::size_t>(levels) + 1),
      users_(pool_.size(), 0),
      slots_(2 * static_cast<std::size_t>(levels), -1),
      units_(kRowsHigh, sensor.width) {
    const double column_rad = sensor.column_rad();
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
    for (Windows& row : rows_) row.resize(sensor.width);
    for (Windows* windows : {&joined_, &halved_, &halved_again_}) windows->resize(sensor.width);
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

void ReferenceImages::Windows::resize(int width) {
    for (auto* v : {&low_values, &high_values, &missing_values})
        v->assign(kBorder + static_cast<std::size_t>(width) + 2, 0);
}

void ReferenceImages::Windows::wrap(int n) {
    for (std::uint16_t* v : {low(), high(), missing()}) {
        v[-1] = v[n - 1];
        v[n] = v[0];
    }
}

void ReferenceImages::fill_cells(Windows& windows, int rows, int bits, std::uint32_t* cells) {
    Windows* units = &windows;
    int n = sensor_.width;
    for (int bit = 1; bit < bits; ++bit) {
        Windows* half = units == &halved_ ? &halved_again_ : &halved_;
        n /= 2;
        halve(n, units->low(), units->high(), units->missing(), half->low(), half->high(), half->missing());
        units = half;
    }
    units->wrap(n);
    const int columns = bits == 0 ? 3 : 2 << bits;
    const int most_missing = rows * columns / 3;
    const auto fill = bits == 0 ? pack_columns : pack_pairs;
    fill(sensor_.width >> bits, most_missing, units->low(), units->high(), units->missing(), cells);
}

void ReferenceImages::fill_windows(const StructuredCloud& cloud, Reference& reference) {
    const int width = sensor_.width;
    const int height = sensor_.height;
    const auto units = [this](int r) { return units_.row(r % kRowsHigh); };
    const auto row = [this](int r) -> Windows& { return rows_[static_cast<std::size_t>(r) % rows_.size()]; };
    const auto stack = [&](int r) {
        if (r + 1 < height) quantize(width, cloud.range_m.row(r + 1), units(r + 1));
        stack_rows(width, units(std::max(0, r - 1)), units(r), units(std::min(height - 1, r + 1)), row(r).low(),
                   row(r).high(), row(r).missing());
    };
    std::uint32_t* narrow = reference.cells.data();
    std::uint32_t* wide = narrow + (sensor_.pixels() >> narrow_bits_);
    quantize(width, cloud.range_m.row(0), units(0));
    stack(0);
    for (int r = 0; r < height; ++r) {
        if (r + 1 < height) stack(r + 1);
        fill_cells(row(r), 3, narrow_bits_, narrow);
        const Windows& above = row(std::max(0, r - 1));
        const Windows& below = row(std::min(height - 1, r + 1));
        join_rows(width, above.low(), below.low(), above.high(), below.high(), above.missing(), below.missing(),
                  joined_.low(), joined_.high(), joined_.missing());
        fill_cells(joined_, 6, wide_bits_, wide);
        narrow += width >> narrow_bits_;
        wide += width >> wide_bits_;
    }
}

}  // namespace dlod
