#include "core/evidence/free_space.hpp"

#include <algorithm>
#include <cmath>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

struct CompareParameters {
    float margin, margin_per_m, tolerance, near;
    std::int32_t pixels;
    float occupied_weight;
};

DLOD_MULTIVERSION void compare(CompareParameters p, int n, const std::int32_t* __restrict pixel,
                               const float* __restrict range, const std::uint32_t* __restrict window,
                               float* __restrict free, float* __restrict occupied) {
    for (int i = 0; i < n; ++i) {
        const std::int32_t inside = pixel[i] >= 0 ? pixel[i] : 0;
        const std::uint32_t seen = window[inside + (range[i] < p.near ? p.pixels : 0)];
        const float nearest = static_cast<float>(static_cast<std::int32_t>(seen & 0xFFFFU)) * kReferenceUnit_m;
        const float farthest = static_cast<float>(static_cast<std::int32_t>(seen >> 16U)) * kReferenceUnit_m;
        const bool known = (pixel[i] >= 0) & (seen != 0U);
        const float grown = p.margin_per_m * range[i];
        const bool is_free = known & (nearest > range[i] + p.margin + grown);
        const bool is_occupied =
            known & (nearest <= range[i] + p.tolerance + grown) & (farthest >= range[i] - p.tolerance - grown);
        free[i] += is_free ? 1.0F : 0.0F;
        occupied[i] += is_occupied ? p.occupied_weight : 0.0F;
    }
}

}  // namespace

FreeSpace::FreeSpace(const SensorModel& sensor, const FreeSpaceConfig& config) : config_(config), projection_(sensor) {
    late_.assign(sensor.pixels(), 0);
    for (int r = 0; r < sensor.height; ++r) {
        max_shift_ = std::max(max_shift_, sensor.pixel_shift[static_cast<std::size_t>(r)]);
        for (int c = 0; c < sensor.width; ++c) {
            late_[static_cast<std::size_t>(r * sensor.width + c)] =
                sensor.measurement_of(r, c) >= sensor.width / 2 ? 1 : 0;
        }
    }
    pixel_.assign(sensor.pixels(), 0);
    range_.assign(sensor.pixels(), 0.0F);
}

void FreeSpace::test(const Frame& frame, std::span<const Reference* const> references, CandidatePoints& points) {
    points.free.assign(points.size(), 0.0F);
    points.occupied.assign(points.size(), 0.0F);
    const OdometryResult& odometry = frame.odometry;
    const int width = projection_.width();
    std::uint32_t begin = 0;
    for (const std::uint32_t end : points.block_end) {
        const int n = static_cast<int>(end - begin);
        if (n == 0) continue;
        // A point in the middle of the block, for the time at which the references looked there.
        const std::uint32_t middle = begin + static_cast<std::uint32_t>(n) / 2;
        const Eigen::Vector3f typical(points.x[middle], points.y[middle], points.z[middle]);
        for (const Reference* const earlier : references) {
            const Reference& reference = *earlier;
            const Eigen::Isometry3f T_reference_sensor =
                (reference.T_world_sensor.inverse() * odometry.T_world_sensor).cast<float>();
            const float* x = points.x.data() + begin;
            const float* y = points.y.data() + begin;
            const float* z = points.z.data() + begin;
            const double age_s = 1e-9 * static_cast<double>(frame.header.stamp_ns - reference.stamp_ns);
            const auto weight =
                static_cast<float>(config_.settle_s > 0.0 ? std::clamp(age_s / config_.settle_s, 0.0, 1.0) : 1.0);
            const CompareParameters parameters{static_cast<float>(config_.margin_m),
                                               static_cast<float>(config_.margin_per_m),
                                               static_cast<float>(config_.occupied_tolerance_m),
                                               static_cast<float>(config_.near_m),
                                               static_cast<std::int32_t>(late_.size()),
                                               weight};
            const auto column_of = [&](const Eigen::Isometry3f& T) {
                const Eigen::Vector3f p = T * typical;
                const auto pixel = projection_.project(Eigen::Vector3f(p.x(), p.y(), 0.0F));
                return pixel ? pixel->column : 0;
            };
            const auto block_of = [&](int column) {
                return static_cast<std::size_t>(column * Reference::kBlocks / width);
            };
            std::size_t block = block_of(column_of(T_reference_sensor));
            block = block_of(column_of(reference.T_block_stamp[block] * T_reference_sensor));
            projection_.project(reference.T_block_stamp[block] * T_reference_sensor, n, x, y, z,
                                reference.column_shift.data(), pixel_.data(), range_.data());
            // At the seam rows of a block were fired at both ends of the sweep.
            const int first = static_cast<int>(block) * width / Reference::kBlocks - width / Reference::kBlocks;
            const bool seam = first < max_shift_ || block + 1 == Reference::kBlocks;
            if (seam) {
                for (int i = 0; i < n; ++i) {
                    if (pixel_[static_cast<std::size_t>(i)] >= 0) {
                        const auto p = static_cast<std::size_t>(pixel_[static_cast<std::size_t>(i)]);
                        const bool late_expected = block + 1 == Reference::kBlocks;
                        if ((late_[p] != 0) != late_expected) pixel_[static_cast<std::size_t>(i)] = -1;
                    }
                }
            }
            compare(parameters, n, pixel_.data(), range_.data(), reference.window.data(), points.free.data() + begin,
                    points.occupied.data() + begin);
            if (seam && block + 1 < Reference::kBlocks) {
                projection_.project(reference.T_block_stamp_late[block] * T_reference_sensor, n, x, y, z,
                                    reference.column_shift.data(), pixel_.data(), range_.data());
                for (int i = 0; i < n; ++i) {
                    auto& pixel = pixel_[static_cast<std::size_t>(i)];
                    if (pixel >= 0 && late_[static_cast<std::size_t>(pixel)] == 0) pixel = -1;
                }
                compare(parameters, n, pixel_.data(), range_.data(), reference.window.data(),
                        points.free.data() + begin, points.occupied.data() + begin);
            }
        }
        begin = end;
    }
}

}  // namespace dlod
