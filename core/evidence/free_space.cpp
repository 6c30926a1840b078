#include "core/evidence/free_space.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr float kUnknownGap = -1e6F;
constexpr float kFastest_mps = 30.0F;
constexpr float kUneven = 0.3F;  // what moves away does so at a speed that is constant to that share

constexpr int kChunk = 256;  // points between the steps of a comparison

struct CompareParameters {
    float margin, margin_per_m, tolerance, near;
    int narrow_bits, wide_bits;
    std::int32_t wide_begin;
    float occupied_weight;
    float receding_margin, receding_margin_per_m;
    float per_age;  // 1/s
};

/// What a comparison finds out about each point.
struct CompareResults {
    float* __restrict free;  // sums
    float* __restrict occupied;
    float* __restrict surface;
    float* __restrict gap;    // by how much something nearer hid the point,
    float* __restrict cover;  // and the farthest that was seen there
};

DLOD_MULTIVERSION_512 void compare(const CompareParameters& parameters, int n, const std::int32_t* __restrict pixel,
                                   const float* __restrict range, const std::uint32_t* __restrict cells,
                                   const CompareResults& results) {
    const CompareParameters p = parameters;
    const CompareResults out = results;
    std::int32_t cell[kChunk];
    for (int begin = 0; begin < n; begin += kChunk) {
        const int count = n - begin < kChunk ? n - begin : kChunk;
        for (int i = 0; i < count; ++i) {
            const std::int32_t inside = pixel[begin + i] > 0 ? pixel[begin + i] : 0;
            const std::int32_t narrow = inside >> p.narrow_bits;
            const std::int32_t wide = p.wide_begin + (inside >> p.wide_bits);
            cell[i] = range[begin + i] < p.near ? wide : narrow;
        }
        for (int i = 0; i < count; ++i) {
            const std::uint32_t seen = cells[cell[i]];
            const float r = range[begin + i];
            const float nearest = static_cast<float>(static_cast<std::int32_t>(seen & 0xFFFFU)) * kReferenceUnit_m;
            const float farthest = static_cast<float>(static_cast<std::int32_t>(seen >> 16U)) * kReferenceUnit_m;
            const float grown = p.margin_per_m * r;
            const float margin = p.margin + grown;
            const float gap = r - nearest;
            const bool known = (pixel[begin + i] >= 0) & (seen != 0U);
            const bool is_free = known & (gap < -margin);
            const float reach = p.tolerance + grown;
            const bool is_occupied = known & (gap >= -reach) & (farthest >= r - reach);
            const bool is_between = (gap > reach) & (farthest > r + reach);
            out.free[begin + i] += is_free ? 1.0F : 0.0F;
            out.occupied[begin + i] += is_occupied ? p.occupied_weight : 0.0F;
            out.surface[begin + i] += is_occupied & !is_between ? p.occupied_weight : 0.0F;
            out.gap[begin + i] = known ? gap : kUnknownGap;
            out.cover[begin + i] = known ? r - farthest : kUnknownGap;
        }
    }
}

/// Finds the points that something hid and that may have moved away from there, and bounds the speed of the others.
DLOD_MULTIVERSION void find_hidden(const CompareParameters& parameters, int n, const float* __restrict range,
                                   const float* __restrict gaps, const float* __restrict covers,
                                   float* __restrict fastest_bound, float* __restrict came,
                                   std::uint8_t* __restrict hidden) {
    const CompareParameters p = parameters;
    for (int i = 0; i < n; ++i) {
        const float gap = gaps[i];
        const float cover = covers[i];
        const float margin = p.receding_margin + p.receding_margin_per_m * range[i];
        const float bound = fastest_bound[i];
        // Where something far nearer was seen, that went by; where it was seen at the same place, or almost so, it can
        // only have come slowly.
        const float slowest = ((1.0F - kUneven) * cover - margin) * p.per_age;
        const float fastest = (gap + kUneven * std::abs(gap) + margin) * p.per_age;
        const float of_hidden = slowest > bound ? 0.0F : bound;
        const float of_seen = fastest < bound ? fastest : bound;
        const float of_rest = gap >= -margin ? of_seen : bound;
        came[i] += (gap < -margin) & (gap > kUnknownGap) ? 1.0F : 0.0F;
        fastest_bound[i] = cover > margin ? of_hidden : of_rest;
        hidden[i] = (cover > margin) & (slowest <= bound) & (bound > 0.0F) ? 1 : 0;
    }
}

/// How far the points lie beyond what was seen in their directions, and outside of all of it.
DLOD_MULTIVERSION_512 void measure_shift(int narrow_bits, float margin, float margin_per_m, int n,
                                         const std::int32_t* __restrict pixel, const float* __restrict range,
                                         const std::uint32_t* __restrict cells, float* __restrict shift,
                                         float* __restrict outside) {
    for (int i = 0; i < n; ++i) {
        const std::int32_t inside = pixel[i] > 0 ? pixel[i] : 0;
        const std::uint32_t seen = cells[inside >> narrow_bits];
        const float r = range[i];
        const float nearest = static_cast<float>(static_cast<std::int32_t>(seen & 0xFFFFU)) * kReferenceUnit_m;
        const float farthest = static_cast<float>(static_cast<std::int32_t>(seen >> 16U)) * kReferenceUnit_m;
        const bool known = (pixel[i] >= 0) & (seen != 0U);
        const float limit = margin + margin_per_m * r;
        const float beyond = r - farthest - limit;
        const float before = nearest - r - limit;
        const float farther = beyond > 0.0F ? beyond : 0.0F;
        const float nearer = before > 0.0F ? before : 0.0F;
        shift[i] = known ? r - 0.5F * (nearest + farthest) : shift[i];
        outside[i] = known ? farther - nearer : outside[i];
    }
}

/// Lists the marked ones of n points. @return how many there are
std::size_t list_marked(std::size_t n, const std::uint8_t* __restrict marks, std::int32_t* __restrict list) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; ++i) {
        list[count] = static_cast<std::int32_t>(i);
        count += marks[i];
    }
    return count;
}

/// Where something by `gap` nearer stood before the listed points, seen from the origin.
DLOD_MULTIVERSION void place_hiders(std::size_t n, const std::int32_t* __restrict list, const float* __restrict gap,
                                    const float* __restrict range, const float* __restrict x, const float* __restrict y,
                                    const float* __restrict z, const Eigen::Vector3f& origin, float* __restrict hider_x,
                                    float* __restrict hider_y, float* __restrict hider_z) {
    const float ox = origin.x(), oy = origin.y(), oz = origin.z();
    for (std::size_t h = 0; h < n; ++h) {
        const std::int32_t i = list[h];
        const float share = 1.0F - gap[i] / range[i];
        hider_x[h] = ox + share * (x[i] - ox);
        hider_y[h] = oy + share * (y[i] - oy);
        hider_z[h] = oz + share * (z[i] - oz);
    }
}

}  // namespace

FreeSpace::FreeSpace(const SensorModel& sensor, const FreeSpaceConfig& config, int narrow_bits, int wide_bits)
    : config_(config),
      projection_(sensor),
      T_lidar_sensor_(sensor.T_sensor_lidar.inverse().cast<float>()),
      narrow_bits_(narrow_bits),
      wide_bits_(wide_bits) {
    late_.assign(sensor.pixels(), 0);
    double columns = 0.0;
    const double column_rad = sensor.column_rad();
    for (int r = 0; r < sensor.height; ++r) {
        const auto row = static_cast<std::size_t>(r);
        max_shift_ = std::max(max_shift_, sensor.pixel_shift[row]);
        columns += sensor.pixel_shift[row] - static_cast<double>(sensor.azimuth_offset_rad[row]) / column_rad;
        for (int c = 0; c < sensor.width; ++c) {
            late_[row * static_cast<std::size_t>(sensor.width) + static_cast<std::size_t>(c)] =
                sensor.measurement_of(r, c) >= sensor.width / 2 ? 1 : 0;
        }
    }
    mean_offset_rad_ = static_cast<float>(columns / std::max(1, sensor.height) * column_rad);
    pixel_.assign(sensor.pixels(), 0);
    for (auto* v : {&range_, &gap_, &cover_, &hider_x_, &hider_y_, &hider_z_, &hider_range_})
        v->assign(sensor.pixels(), 0.0F);
    hider_pixel_.assign(sensor.pixels(), 0);
    hidden_.assign(sensor.pixels(), 0);
    behind_.assign(sensor.pixels(), 0);
}

/// The block that looks at a point, by its azimuth alone.
std::size_t FreeSpace::block_of(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f p = T_lidar_sensor_ * point;
    constexpr auto kTurn = static_cast<float>(2.0 * std::numbers::pi);
    const float turns = (mean_offset_rad_ - std::atan2(p.y(), p.x())) / kTurn;
    const auto block = static_cast<std::size_t>((turns - std::floor(turns)) * static_cast<float>(Reference::kBlocks));
    return std::min<std::size_t>(block, Reference::kBlocks - 1);
}

// What hid a place in a recent frame and is gone now may have moved away to just there: then it hid the place by more
// the longer ago. An edge behind which the place has come into view is still there, and what passed by hid it by the
// same all the time.
void FreeSpace::follow_receding(const Comparison& comparison, const Eigen::Isometry3f& T_column_sensor, int begin,
                                int n, CandidatePoints& points) {
    const auto margin_at = [this](float range) {
        return static_cast<float>(config_.receding_margin_m) +
               static_cast<float>(config_.receding_margin_per_m) * range;
    };
    const std::size_t behind = list_marked(static_cast<std::size_t>(n), hidden_.data(), behind_.data());
    if (behind == 0) return;
    place_hiders(behind, behind_.data(), gap_.data(), range_.data(), points.x.data() + begin, points.y.data() + begin,
                 points.z.data() + begin, T_column_sensor.inverse().translation(), hider_x_.data(), hider_y_.data(),
                 hider_z_.data());
    const Reference& now = comparison.now;
    const std::size_t block = block_of({hider_x_[0], hider_y_[0], hider_z_[0]});
    projection_.project(now.T_block_stamp[block], static_cast<int>(behind), hider_x_.data(), hider_y_.data(),
                        hider_z_.data(), now.column_shift.data(), hider_pixel_.data(), hider_range_.data());
    for (std::size_t h = 0; h < behind; ++h) {
        const auto k = static_cast<std::size_t>(behind_[h]);
        const std::size_t i = static_cast<std::size_t>(begin) + k;
        const float margin = margin_at(range_[k]);
        const std::uint32_t seen =
            hider_pixel_[h] < 0 ? 0U : now.cells[static_cast<std::size_t>(hider_pixel_[h]) >> narrow_bits_];
        if (static_cast<float>(seen & 0xFFFFU) * kReferenceUnit_m > hider_range_[h] + margin_at(hider_range_[h])) {
            points.gone[i] += 1.0F;
            points.slowest[i] = std::max(points.slowest[i], ((1.0F - kUneven) * cover_[k] - margin) / comparison.age_s);
            points.fastest[i] = std::min(points.fastest[i], ((1.0F + kUneven) * gap_[k] + margin) / comparison.age_s);
        }
    }
}

void FreeSpace::compare_block(const Comparison& comparison, const Eigen::Isometry3f& T_column_sensor, int begin, int n,
                              CandidatePoints& points) {
    const CompareParameters parameters{static_cast<float>(config_.margin_m),
                                       static_cast<float>(config_.margin_per_m),
                                       static_cast<float>(config_.occupied_tolerance_m),
                                       static_cast<float>(config_.near_m),
                                       narrow_bits_,
                                       wide_bits_,
                                       static_cast<std::int32_t>(late_.size() >> narrow_bits_),
                                       comparison.occupied_weight,
                                       static_cast<float>(config_.receding_margin_m),
                                       static_cast<float>(config_.receding_margin_per_m),
                                       1.0F / comparison.age_s};
    const CompareResults results{points.free.data() + begin, points.occupied.data() + begin,
                                 points.surface.data() + begin, gap_.data(), cover_.data()};
    compare(parameters, n, pixel_.data(), range_.data(), comparison.reference.cells.data(), results);
    if (comparison.order < CandidatePoints::kShifts) {
        measure_shift(narrow_bits_, static_cast<float>(config_.shift_margin_m),
                      static_cast<float>(config_.shift_margin_per_m), n, pixel_.data(), range_.data(),
                      comparison.reference.cells.data(), points.shift[comparison.order].data() + begin,
                      points.outside.data() + begin);
    }
    if (!comparison.recent) return;
    find_hidden(parameters, n, range_.data(), gap_.data(), cover_.data(), points.fastest.data() + begin,
                points.came.data() + begin, hidden_.data());
    follow_receding(comparison, T_column_sensor, begin, n, points);
}

void FreeSpace::test_block(const Comparison& comparison, int begin, int n, CandidatePoints& points) {
    const Reference& reference = comparison.reference;
    // A point in the middle of the block tells when the reference looked there; one step corrects for the motion by
    // then.
    const auto middle = static_cast<std::size_t>(begin + n / 2);
    const Eigen::Vector3f typical =
        comparison.T_reference_sensor * Eigen::Vector3f(points.x[middle], points.y[middle], points.z[middle]);
    const std::size_t block = block_of(reference.T_block_stamp[block_of(typical)] * typical);
    const auto project = [&](const Eigen::Isometry3f& T_column_sensor) {
        projection_.project(T_column_sensor, n, points.x.data() + begin, points.y.data() + begin,
                            points.z.data() + begin, reference.column_shift.data(), pixel_.data(), range_.data());
    };
    const auto keep = [&](bool late) {
        for (int i = 0; i < n; ++i) {
            std::int32_t& pixel = pixel_[static_cast<std::size_t>(i)];
            if (pixel >= 0 && (late_[static_cast<std::size_t>(pixel)] != 0) != late) pixel = -1;
        }
    };
    const Eigen::Isometry3f T_column_sensor = reference.T_block_stamp[block] * comparison.T_reference_sensor;
    project(T_column_sensor);
    // At the seam the rows of a block were fired at both ends of the sweep.
    const bool last = block + 1 == Reference::kBlocks;
    const bool seam = last || (static_cast<int>(block) - 1) * projection_.width() / Reference::kBlocks < max_shift_;
    if (seam) keep(last);
    compare_block(comparison, T_column_sensor, begin, n, points);
    if (!seam || last) return;
    const Eigen::Isometry3f T_late_sensor = reference.T_block_stamp_late[block] * comparison.T_reference_sensor;
    project(T_late_sensor);
    keep(true);
    compare_block(comparison, T_late_sensor, begin, n, points);
}

void FreeSpace::test(const Frame& frame, std::span<const Reference* const> references, const Reference& now,
                     CandidatePoints& points) {
    for (auto* v : {&points.free, &points.occupied, &points.surface, &points.gone, &points.came})
        v->assign(points.size(), 0.0F);
    points.slowest.assign(points.size(), static_cast<float>(config_.min_receding_mps));
    points.fastest.assign(points.size(), kFastest_mps);
    for (auto& shift : points.shift) shift.assign(points.size(), CandidatePoints::kNoShift);
    points.outside.assign(points.size(), 0.0F);
    std::size_t order = 0;
    for (const Reference* const reference : references) {
        const double age_s = 1e-9 * static_cast<double>(frame.header.stamp_ns - reference->stamp_ns);
        const double weight = config_.settle_s > 0.0 ? std::clamp(age_s / config_.settle_s, 0.0, 1.0) : 1.0;
        const Comparison comparison{*reference,
                                    now,
                                    (reference->T_world_sensor.inverse() * frame.odometry.T_world_sensor).cast<float>(),
                                    static_cast<float>(age_s),
                                    static_cast<float>(weight),
                                    age_s > 0.0 && age_s <= config_.receding_s,
                                    order++};
        int begin = 0;
        for (const std::uint32_t block_end : points.block_end) {
            const int end = static_cast<int>(block_end);
            if (end > begin) test_block(comparison, begin, end - begin, points);
            begin = end;
        }
    }
}

}  // namespace dlod
