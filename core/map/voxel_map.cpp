#include "core/map/voxel_map.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr std::size_t kInitialTable = std::size_t{1} << 13;  // blocks
constexpr std::size_t kInitialVoxels = std::size_t{1} << 15;
constexpr std::size_t kInitialFacets = std::size_t{1} << 16;

/// Quotient of a whole number, rounded down, and remainder.
struct Quotient {
    std::int32_t whole, rest;
};

/// Without a division. @param inverse 1 / b
inline Quotient divide(std::int32_t a, std::int32_t b, double inverse) {
    // Off by one at most: the remainder tells, in masks.
    Quotient q;
    q.whole = static_cast<std::int32_t>(static_cast<double>(a) * inverse);
    q.rest = a - q.whole * b;
    const std::int32_t under = q.rest >> 31;
    q.whole += under;
    q.rest += b & under;
    const std::int32_t over = (b - 1 - q.rest) >> 31;
    q.whole -= over;
    q.rest -= b & over;
    return q;
}

}  // namespace

VoxelMap::VoxelMap(const VoxelMapConfig& config) : config_(config) {
    // Even, so that the centre is a whole number too.
    side_ = std::max<std::int32_t>(2, 2 * static_cast<std::int32_t>(std::lround(0.5 * config.voxel_m / kMapUnit_m)));
    const double radius = config.surfel_radius_m / kMapUnit_m;
    disc_ = std::llround(0.25 * radius * radius);
    table_.resize(kInitialTable);
    blocks_.reserve(kInitialTable / 2);
    free_blocks_.reserve(kInitialTable / 2);
    voxels_.reserve(kInitialVoxels);
    voxel_planes_.reserve(kInitialVoxels);
    free_voxels_.reserve(kInitialVoxels);
    facets_.reserve(kInitialFacets);
    facet_planes_.reserve(kInitialFacets);
    free_facets_.reserve(kInitialFacets);
}

void VoxelMap::clear() {
    std::fill(table_.begin(), table_.end(), Entry{});
    blocks_.clear();
    free_blocks_.clear();
    block_count_ = 0;
    last_key_ = kEmpty;
    voxels_.clear();
    voxel_planes_.clear();
    free_voxels_.clear();
    facets_.clear();
    facet_planes_.clear();
    free_facets_.clear();
    voxel_count_ = 0;
}

VoxelIndex VoxelMap::index_of(const FixedPoint& p) const {
    const double inverse = 1.0 / side_;
    return {divide(p.x, side_, inverse).whole, divide(p.y, side_, inverse).whole, divide(p.z, side_, inverse).whole};
}

std::uint32_t VoxelMap::make_block(std::uint64_t key) {
    if (2 * (block_count_ + 1) > table_.size()) grow();
    std::uint32_t block;
    if (free_blocks_.empty()) {
        block = static_cast<std::uint32_t>(blocks_.size());
        blocks_.emplace_back();
    } else {
        block = free_blocks_.back();
        free_blocks_.pop_back();
    }
    blocks_[block].slot.fill(kNone);
    blocks_[block].occupied = 0;
    table_[locate(key)] = {key, block};
    ++block_count_;
    last_key_ = key;
    last_block_ = block;
    return block;
}

std::uint32_t VoxelMap::make_voxel() {
    ++voxel_count_;
    std::uint32_t slot;
    if (free_voxels_.empty()) {
        slot = static_cast<std::uint32_t>(voxels_.size());
        voxels_.emplace_back();
        voxel_planes_.emplace_back();
    } else {
        slot = free_voxels_.back();
        free_voxels_.pop_back();
    }
    voxels_[slot].facet.fill(kNone);
    voxels_[slot].facets = 0;
    return slot;
}

std::uint32_t VoxelMap::make_facet() {
    if (free_facets_.empty()) {
        facets_.emplace_back();
        facet_planes_.emplace_back();
        return static_cast<std::uint32_t>(facets_.size() - 1);
    }
    const std::uint32_t slot = free_facets_.back();
    free_facets_.pop_back();
    facets_[slot] = Moments{};
    return slot;
}

/// The axis of the world that the normal is nearest to, and its sign.
std::size_t VoxelMap::facet_of(const FixedPoint& p) {
    const int n[3] = {p.nx, p.ny, p.nz};
    std::size_t axis = 0;
    for (std::size_t i = 1; i < 3; ++i) {
        if (std::abs(n[i]) > std::abs(n[axis])) axis = i;
    }
    if (n[axis] == 0) return kNoNormal;
    return 2 * axis + (n[axis] > 0 ? 1 : 0);
}

void VoxelMap::accumulate(std::span<const FixedPoint> points, int sign) {
    constexpr std::int64_t kOne = std::int64_t{kNormalUnits} * kNormalUnits;
    const double inverse_side = 1.0 / side_;
    for (const FixedPoint& p : points) {
        const Quotient x = divide(p.x, side_, inverse_side);
        const Quotient y = divide(p.y, side_, inverse_side);
        const Quotient z = divide(p.z, side_, inverse_side);
        const VoxelIndex index{x.whole, y.whole, z.whole};
        const std::uint64_t key = key_of(index);
        std::uint32_t block = block_of(key);
        if (block == kNone) block = make_block(key);
        const std::size_t position = position_in_block(index);
        std::uint32_t& slot = blocks_[block].slot[position];
        if (slot == kNone) {
            slot = make_voxel();
            blocks_[block].occupied |= std::uint64_t{1} << position;
        }
        Voxel& voxel = voxels_[slot];
        const std::size_t side = facet_of(p);
        if (voxel.facet[side] == kNone) {
            voxel.facet[side] = make_facet();
            ++voxel.facets;
        }
        const std::uint32_t facet = voxel.facet[side];
        Moments& m = facets_[facet];
        const std::int64_t d[3] = {x.rest - side_ / 2, y.rest - side_ / 2, z.rest - side_ / 2};
        const std::int64_t n[3] = {p.nx, p.ny, p.nz};
        const bool disc = side != kNoNormal;
        const std::int32_t weight = disc ? sign * kFlatWeight : sign;
        m.points += sign;
        m.weight += weight;
        for (std::size_t i = 0, k = 0; i < 3; ++i) {
            m.sum[i] += weight * d[i];
            for (std::size_t j = i; j < 3; ++j, ++k) {
                const std::int64_t own = disc ? disc_ * ((i == j ? kOne : 0) - n[i] * n[j]) / kOne : 0;
                m.square[k] += weight * (d[i] * d[j] + own);
            }
        }
        facet_planes_[facet].fitted = voxel_planes_[slot].fitted = false;
        if (m.points == 0) {
            free_facets_.push_back(facet);
            voxel.facet[side] = kNone;
            --voxel.facets;
        }
        if (voxel.facets == 0) {
            free_voxels_.push_back(slot);
            slot = kNone;
            --voxel_count_;
            blocks_[block].occupied &= ~(std::uint64_t{1} << position);
            if (blocks_[block].occupied == 0) erase_block(key);
        }
    }
}

void VoxelMap::erase_block(std::uint64_t key) {
    // Entries that were pushed along by this one move back, so that no search ends early.
    const std::size_t mask = table_.size() - 1;
    std::size_t hole = locate(key);
    free_blocks_.push_back(table_[hole].block);
    std::size_t next = (hole + 1) & mask;
    while (table_[next].key != kEmpty) {
        const std::size_t home = home_of(table_[next].key);
        if (((next - home) & mask) >= ((next - hole) & mask)) {
            table_[hole] = table_[next];
            hole = next;
        }
        next = (next + 1) & mask;
    }
    table_[hole] = Entry{};
    --block_count_;
    last_key_ = kEmpty;
}

void VoxelMap::grow() {
    std::vector<Entry> old(table_.size() * 2);
    old.swap(table_);
    for (const Entry& entry : old) {
        if (entry.key != kEmpty) table_[locate(entry.key)] = entry;
    }
}

const VoxelPlane* VoxelMap::find_facet(VoxelIndex index, const float normal[3]) {
    const std::uint32_t slot = voxel_at(index);
    if (slot == kNone) return nullptr;
    const VoxelPlane* best = nullptr;
    float most = 0.0F;
    for (std::size_t side = 0; side < kNoNormal; ++side) {
        const std::uint32_t facet = voxels_[slot].facet[side];
        if (facet == kNone) continue;
        if (!facet_planes_[facet].fitted) fit_facet(facet);
        const VoxelPlane& plane = facet_planes_[facet];
        if (!plane.flat) continue;
        // The fit gives the normal but for its sign; the facet's side has it.
        const float sign = (plane.normal[side / 2] > 0.0F) == (side % 2 == 1) ? 1.0F : -1.0F;
        const float cosine =
            sign * (plane.normal[0] * normal[0] + plane.normal[1] * normal[1] + plane.normal[2] * normal[2]);
        if (cosine > most) {
            most = cosine;
            best = &plane;
        }
    }
    return best;
}

void VoxelMap::fit_facet(std::uint32_t slot) {
    fit(facets_[slot], facet_planes_[slot]);
    facet_planes_[slot].surface = 2 * slot;
}

/// All facets together; one alone is the voxel.
void VoxelMap::fit_voxel(std::uint32_t slot) {
    const Voxel& voxel = voxels_[slot];
    Moments all;
    for (const std::uint32_t i : voxel.facet) {
        if (i == kNone) continue;
        if (voxel.facets == 1) {
            if (!facet_planes_[i].fitted) fit_facet(i);
            voxel_planes_[slot] = facet_planes_[i];
            return;
        }
        const Moments& m = facets_[i];
        all.points += m.points;
        all.weight += m.weight;
        for (std::size_t k = 0; k < 3; ++k) all.sum[k] += m.sum[k];
        for (std::size_t k = 0; k < 6; ++k) all.square[k] += m.square[k];
    }
    fit(all, voxel_planes_[slot]);
    voxel_planes_[slot].surface = 2 * slot + 1;
}

void VoxelMap::fit(const Moments& m, VoxelPlane& plane) const {
    plane.fitted = true;
    plane.points = static_cast<std::uint32_t>(m.points);
    const double n = m.weight;
    const auto sum = [&](std::size_t k) { return static_cast<double>(m.sum[k]); };
    const Eigen::Vector3d mean = Eigen::Vector3d(sum(0), sum(1), sum(2)) / n;
    const auto at = [&](std::size_t k) { return static_cast<double>(m.square[k]) / n; };
    Eigen::Matrix3d covariance;
    covariance << at(0), at(1), at(2), at(1), at(3), at(4), at(2), at(4), at(5);
    covariance -= mean * mean.transpose();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(covariance);
    const Eigen::Vector3d deviation = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt() * kMapUnit_m;
    for (int i = 0; i < 3; ++i) {
        plane.mean[i] = static_cast<float>(mean[i] * kMapUnit_m);
        plane.normal[i] = static_cast<float>(solver.eigenvectors()(i, 0));
        plane.tangent[i] = static_cast<float>(solver.eigenvectors()(i, 2));
    }
    plane.thickness_m = static_cast<float>(std::max(deviation[0], config_.noise_m));
    plane.extent_m[0] = static_cast<float>(deviation[2]);
    plane.extent_m[1] = static_cast<float>(deviation[1]);
    plane.flat = m.weight >= config_.min_points * kFlatWeight && deviation[0] <= config_.max_thickness_m &&
                 deviation[0] <= 0.5 * deviation[1];
}

}  // namespace dlod
