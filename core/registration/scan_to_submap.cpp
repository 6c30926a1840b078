#include "core/registration/scan_to_submap.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace dlod {
namespace {

constexpr std::size_t kBatch = 64;  // points that are looked up before any is worked on

// A kernel of so many standard deviations of the guess lets a body be found where it may be. Below the least one a
// prediction that has missed a shock would no longer be put right.
constexpr double kKernelDeviations = 2.0;
constexpr double kLeastKernel_m = 0.05;

inline float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Voxel around q, and q relative to its centre.
struct Cell {
    VoxelIndex index;
    float offset[3];
};

inline Cell cell_of(const float q[3], VoxelIndex origin, float side, float inverse_side) {
    const float fx = std::floor(q[0] * inverse_side);
    const float fy = std::floor(q[1] * inverse_side);
    const float fz = std::floor(q[2] * inverse_side);
    return {{origin.x + static_cast<std::int32_t>(fx), origin.y + static_cast<std::int32_t>(fy),
             origin.z + static_cast<std::int32_t>(fz)},
            {q[0] - (fx + 0.5F) * side, q[1] - (fy + 0.5F) * side, q[2] - (fz + 0.5F) * side}};
}

/// Distance to the voxel's Gaussian: across a plane all of it counts, else what exceeds two standard deviations.
float distance_to(const VoxelPlane& plane, const float offset[3]) {
    const float d[3] = {offset[0] - plane.mean[0], offset[1] - plane.mean[1], offset[2] - plane.mean[2]};
    const float* n = plane.normal;
    const float* t = plane.tangent;
    const float u[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
    const float across = std::max(0.0F, std::abs(dot(d, n)) - (plane.flat ? 0.0F : 2.0F * plane.thickness_m));
    const float along = std::max(0.0F, std::abs(dot(d, t)) - 2.0F * plane.extent_m[0]);
    const float aside = std::max(0.0F, std::abs(dot(d, u)) - 2.0F * plane.extent_m[1]);
    return std::sqrt(across * across + along * along + aside * aside);
}

/// The nearest of the Gaussians in the 26 voxels around an empty one.
float distance_to_neighbours(VoxelMap& map, const Cell& cell, float side, float cap) {
    float nearest = cap;
    // A voxel whose nearest side is farther than the best so far has nothing to offer.
    const auto gap = [&](int step, float offset) {
        return step == 0 ? 0.0F : 0.5F * side - static_cast<float>(step) * offset;
    };
    map.for_each_around(cell.index, [&](VoxelIndex index, const VoxelPlane& plane) {
        const float gx = gap(index.x - cell.index.x, cell.offset[0]);
        const float gy = gap(index.y - cell.index.y, cell.offset[1]);
        const float gz = gap(index.z - cell.index.z, cell.offset[2]);
        if (gx * gx + gy * gy + gz * gz >= nearest * nearest) return;
        const float offset[3] = {cell.offset[0] - static_cast<float>(index.x - cell.index.x) * side,
                                 cell.offset[1] - static_cast<float>(index.y - cell.index.y) * side,
                                 cell.offset[2] - static_cast<float>(index.z - cell.index.z) * side};
        nearest = std::min(nearest, distance_to(plane, offset));
    });
    return nearest;
}

}  // namespace

void ScanToSubmap::match(const PointSelection& points, std::span<const std::uint8_t> excluded,
                         const PlacedPoints& placed, VoxelMap& map, VoxelIndex origin, double widening,
                         PlaneMatches& matches, double deviation_m) const {
    const auto side = static_cast<float>(map.voxel_m());
    const float inverse_side = 1.0F / side;
    const auto gate = static_cast<float>(config_.gate_m * widening);
    const auto kernel = static_cast<float>(
        std::clamp(kKernelDeviations * deviation_m, std::min(kLeastKernel_m, config_.kernel_m), config_.kernel_m) *
        widening);
    const float inverse_kernel2 = 1.0F / (kernel * kernel);
    const auto min_cosine = static_cast<float>(config_.min_normal_cosine);
    matches.reserve(points.pixel.capacity());
    matches.clear();
    for (std::size_t i = 0; i < excluded.size(); ++i) {
        if (points.planarity[i] <= 0.0F || excluded[i]) continue;
        const float q[3] = {placed.x[i], placed.y[i], placed.z[i]};
        const Cell cell = cell_of(q, origin, side, inverse_side);
        const bool flat = points.is_flat(i);
        const float normal[3] = {placed.nx[i], placed.ny[i], placed.nz[i]};
        const VoxelPlane* plane = map.find(cell.index);
        // A voxel that is not flat as a whole, or not as the point is, may have a facet that faces as the point does.
        if (flat && plane != nullptr && (!plane->flat || std::abs(dot(normal, plane->normal)) < min_cosine)) {
            plane = map.find_facet(cell.index, normal);
        }
        if (plane == nullptr || !plane->flat) continue;
        const float d[3] = {cell.offset[0] - plane->mean[0], cell.offset[1] - plane->mean[1],
                            cell.offset[2] - plane->mean[2]};
        const float residual = dot(d, plane->normal);
        if (std::abs(residual) > gate) continue;
        if (flat && std::abs(dot(normal, plane->normal)) < min_cosine) continue;
        const float fall = 1.0F / (1.0F + residual * residual * inverse_kernel2);
        const float weight = points.planarity[i] * fall * fall / (plane->thickness_m * plane->thickness_m);
        const float lever[3] = {placed.lx[i], placed.ly[i], placed.lz[i]};
        matches.push(plane->normal, lever, residual, weight, points.time_s[i], plane->surface,
                     static_cast<std::uint32_t>(i));
        if (flat) matches.flat = matches.count;
    }
}

void ScanToSubmap::residuals(const PointSelection& points, const PlacedPoints& placed, VoxelMap& map, VoxelIndex origin,
                             AlignedVector<PixelIndex>& pixel, AlignedVector<float>& residual_m,
                             const Image<std::uint8_t>* ground) const {
    const auto side = static_cast<float>(map.voxel_m());
    const float inverse_side = 1.0F / side;
    const auto cap = static_cast<float>(config_.residual_cap_m);
    pixel.reserve(points.pixel.capacity());
    residual_m.reserve(points.pixel.capacity());
    pixel.resize(points.size());
    residual_m.resize(points.size());
    std::size_t count = 0;
    struct Searched {
        Cell cell;
        std::uint32_t place;
    };
    std::array<Searched, kBatch> batch;
    for (std::size_t i = 0; i < points.size();) {
        const std::size_t first = count;
        for (; i < points.size() && count - first < kBatch; ++i) {
            if (ground != nullptr && (*ground)[points.pixel[i]] != 0) continue;
            const float q[3] = {placed.x[i], placed.y[i], placed.z[i]};
            const Cell cell = cell_of(q, origin, side, inverse_side);
            batch[count - first] = {cell, map.where(cell.index)};
            pixel[count++] = points.pixel[i];
        }
        for (std::size_t k = first; k < count; ++k) {
            const auto& [cell, place] = batch[k - first];
            residual_m[k] = place != VoxelMap::kNowhere ? std::min(cap, distance_to(map.plane_at(place), cell.offset))
                                                        : distance_to_neighbours(map, cell, side, cap);
        }
    }
    pixel.resize(count);
    residual_m.resize(count);
}

}  // namespace dlod
