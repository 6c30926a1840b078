#include "core/evidence/free_space.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr int kChunk = 256;  // points between the steps of a comparison

struct CompareParameters {
    float margin, margin_per_m, tolerance, near;
    int narrow_bits, wide_bits;
    std::int32_t wide_begin;
    float occupied_weight;
};

DLOD_MULTIVERSION void compare(const CompareParameters& parameters, int n, const std::int32_t* __restrict pixel,
                               const float* __restrict range, const std::uint32_t* __restrict cells,
                               float* __restrict free_sum, float* __restrict occupied_sum) {
    const CompareParameters p = parameters;
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
            const bool known = (pixel[begin + i] >= 0) & (seen != 0U);
            const bool is_free = known & (nearest > r + p.margin + grown);
            const bool is_occupied =
                known & (nearest <= r + p.tolerance + grown) & (farthest >= r - p.tolerance - grown);
            free_sum[begin + i] += is_free ? 1.0F : 0.0F;
            occupied_sum[begin + i] += is_occupied ? p.occupied_weight : 0.0F;
        }
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
    const double column_rad = 2.0 * std::numbers::pi / sensor.width;
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
    range_.assign(sensor.pixels(), 0.0F);
}

/// The block that looks at a point, by its azimuth alone.
std::size_t FreeSpace::block_of(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f p = T_lidar_sensor_ * point;
    constexpr auto kTurn = static_cast<float>(2.0 * std::numbers::pi);
    const float turns = (mean_offset_rad_ - std::atan2(p.y(), p.x())) / kTurn;
    const auto block = static_cast<std::size_t>((turns - std::floor(turns)) * static_cast<float>(Reference::kBlocks));
    return std::min<std::size_t>(block, Reference::kBlocks - 1);
}

void FreeSpace::compare_with(const Reference& reference, float weight, int begin, int n,
                             CandidatePoints& points) const {
    const CompareParameters parameters{static_cast<float>(config_.margin_m),
                                       static_cast<float>(config_.margin_per_m),
                                       static_cast<float>(config_.occupied_tolerance_m),
                                       static_cast<float>(config_.near_m),
                                       narrow_bits_,
                                       wide_bits_,
                                       static_cast<std::int32_t>(late_.size() >> narrow_bits_),
                                       weight};
    compare(parameters, n, pixel_.data(), range_.data(), reference.cells.data(), points.free.data() + begin,
            points.occupied.data() + begin);
}

void FreeSpace::test_block(const Reference& reference, const Eigen::Isometry3f& T_reference_sensor, float weight,
                           int begin, int n, CandidatePoints& points) {
    // A point in the middle of the block tells when the reference looked there; one step corrects for the motion by
    // then.
    const auto middle = static_cast<std::size_t>(begin + n / 2);
    const Eigen::Vector3f typical =
        T_reference_sensor * Eigen::Vector3f(points.x[middle], points.y[middle], points.z[middle]);
    const std::size_t block = block_of(reference.T_block_stamp[block_of(typical)] * typical);
    const auto project = [&](const Eigen::Isometry3f& T_block_stamp) {
        projection_.project(T_block_stamp * T_reference_sensor, n, points.x.data() + begin, points.y.data() + begin,
                            points.z.data() + begin, reference.column_shift.data(), pixel_.data(), range_.data());
    };
    const auto keep = [&](bool late) {
        for (int i = 0; i < n; ++i) {
            std::int32_t& pixel = pixel_[static_cast<std::size_t>(i)];
            if (pixel >= 0 && (late_[static_cast<std::size_t>(pixel)] != 0) != late) pixel = -1;
        }
    };
    project(reference.T_block_stamp[block]);
    // At the seam the rows of a block were fired at both ends of the sweep.
    const bool last = block + 1 == Reference::kBlocks;
    const bool seam = last || (static_cast<int>(block) - 1) * projection_.width() / Reference::kBlocks < max_shift_;
    if (seam) keep(last);
    compare_with(reference, weight, begin, n, points);
    if (!seam || last) return;
    project(reference.T_block_stamp_late[block]);
    keep(true);
    compare_with(reference, weight, begin, n, points);
}

void FreeSpace::test(const Frame& frame, std::span<const Reference* const> references, CandidatePoints& points) {
    points.free.assign(points.size(), 0.0F);
    points.occupied.assign(points.size(), 0.0F);
    for (const Reference* const reference : references) {
        const Eigen::Isometry3f T_reference_sensor =
            (reference->T_world_sensor.inverse() * frame.odometry.T_world_sensor).cast<float>();
        const double age_s = 1e-9 * static_cast<double>(frame.header.stamp_ns - reference->stamp_ns);
        const double weight = config_.settle_s > 0.0 ? std::clamp(age_s / config_.settle_s, 0.0, 1.0) : 1.0;
        int begin = 0;
        for (const std::uint32_t block_end : points.block_end) {
            const int end = static_cast<int>(block_end);
            if (end > begin)
                test_block(*reference, T_reference_sensor, static_cast<float>(weight), begin, end - begin, points);
            begin = end;
        }
    }
}

}  // namespace dlod
