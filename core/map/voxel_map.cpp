#include "core/map/voxel_map.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr std::size_t kInitialTable = std::size_t{1} << 13;  // blocks
constexpr std::size_t kInitialVoxels = std::size_t{1} << 15;

std::int32_t floor_divide(std::int32_t a, std::int32_t b) {
    const std::int32_t q = a / b;
    return q * b > a ? q - 1 : q;
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
    moments_.reserve(kInitialVoxels);
    planes_.reserve(kInitialVoxels);
    fitted_.reserve(kInitialVoxels);
    free_.reserve(kInitialVoxels);
}

void VoxelMap::clear() {
    std::fill(table_.begin(), table_.end(), Entry{});
    blocks_.clear();
    free_blocks_.clear();
    block_count_ = 0;
    last_key_ = kEmpty;
    moments_.clear();
    planes_.clear();
    fitted_.clear();
    free_.clear();
    voxel_count_ = 0;
}

VoxelIndex VoxelMap::index_of(const FixedPoint& p) const {
    return {floor_divide(p.x, side_), floor_divide(p.y, side_), floor_divide(p.z, side_)};
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
    if (free_.empty()) {
        moments_.emplace_back();
        planes_.emplace_back();
        fitted_.push_back(0);
        return static_cast<std::uint32_t>(moments_.size() - 1);
    }
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    moments_[slot] = Moments{};
    return slot;
}

void VoxelMap::accumulate(std::span<const FixedPoint> points, int sign) {
    constexpr std::int64_t kOne = std::int64_t{kNormalUnits} * kNormalUnits;
    for (const FixedPoint& p : points) {
        const VoxelIndex index = index_of(p);
        const std::uint64_t key = key_of(index);
        std::uint32_t block = block_of(key);
        if (block == kNone) block = make_block(key);
        const std::size_t position = position_in_block(index);
        std::uint32_t& slot = blocks_[block].slot[position];
        if (slot == kNone) {
            slot = make_voxel();
            blocks_[block].occupied |= std::uint64_t{1} << position;
        }
        Moments& m = moments_[slot];
        const std::int64_t d[3] = {p.x - (std::int64_t{index.x} * side_ + side_ / 2),
                                   p.y - (std::int64_t{index.y} * side_ + side_ / 2),
                                   p.z - (std::int64_t{index.z} * side_ + side_ / 2)};
        const std::int64_t n[3] = {p.nx, p.ny, p.nz};
        const bool disc = p.nx != 0 || p.ny != 0 || p.nz != 0;
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
        fitted_[slot] = 0;
        if (m.points == 0) {
            free_.push_back(slot);
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

void VoxelMap::fit(std::uint32_t slot) {
    fitted_[slot] = 1;
    const Moments& m = moments_[slot];
    VoxelPlane& plane = planes_[slot];
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
