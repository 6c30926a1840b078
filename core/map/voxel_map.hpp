// The local map: voxels that hold the moments of the surface elements inside them, in a hash of blocks of 4 x 4 x 4
// voxels: neighbours share a block, so that points of a scan line find theirs without a new search.
//
// A voxel has a facet for each of the six sides that its surfaces may face. So a door frame, a pillar or the end of a
// wall keeps a plane of its own beside the wall's, where one plane for all would be neither: in corridors these narrow
// faces are all that tells how far the robot has come. The two sides of a thin wall are not mixed up either.
//
// Moments are integers in fixed point, so that adding and removing points is exact and independent of their order: a
// keyframe that leaves takes away precisely what it brought. Planes are fitted when they are first asked for.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types/image.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct VoxelMapConfig {
    double voxel_m = 0.5;
    double surfel_radius_m = 0.1;
    int min_points = 1;
    double max_thickness_m = 0.06;
    double noise_m = 0.006;

    template <class V>
    void visit(V& v) {
        v.parameter("voxel_m", voxel_m, Range{0.05, 5.0}, "m",
                    "side of a voxel; larger bridges sparser scans and rounds off detail");
        v.parameter("surfel_radius_m", surfel_radius_m, Range{0.0, 2.0}, "m",
                    "a point counts as a disc of this radius: its normal speaks while points are few");
        v.parameter("min_points", min_points, Range{1, 100}, "points",
                    "a voxel with fewer that have a normal is not flat; 16 without count as one with");
        v.parameter("max_thickness_m", max_thickness_m, Range{0.001, 1.0}, "m",
                    "standard deviation across the plane up to which a voxel counts as flat");
        v.parameter("noise_m", noise_m, Range{0.0005, 0.5}, "m", "floor of that deviation");
    }
};

/// Points in world fixed point coordinates, units of kMapUnit_m, with normals in units of 1 / kNormalUnits.
struct FixedPoint {
    std::int32_t x, y, z;
    std::int16_t nx, ny, nz;  ///< 0, 0, 0: no normal
};
inline constexpr double kMapUnit_m = 1.0 / 4096.0;
inline constexpr int kNormalUnits = 1 << 14;
/// Weight of a point with a normal in its voxel's plane. It is the mean of a flat window; one without a normal may lie
/// on an edge or on a thing before the surface, and must not tilt the plane.
inline constexpr int kFlatWeight = 16;

struct VoxelIndex {
    std::int32_t x = 0, y = 0, z = 0;
    friend bool operator==(const VoxelIndex&, const VoxelIndex&) = default;
};

/// What the registration needs of a voxel, relative to the voxel's centre, metres.
struct alignas(64) VoxelPlane {
    float mean[3];
    float normal[3];
    float thickness_m;    ///< standard deviation along the normal, at least the configured floor
    float extent_m[2];    ///< standard deviations along the two tangents
    float tangent[3];     ///< direction of the larger extent
    bool flat;            ///< false: too few points or too thick, the normal means nothing
    bool fitted = false;  ///< the map's own: false where the moments have changed since
    std::uint32_t points;
    std::uint32_t surface;  ///< number of this plane, another one than those of all others in the map
};

class VoxelMap {
  public:
    explicit VoxelMap(const VoxelMapConfig& config);

    void clear();
    void add(std::span<const FixedPoint> points) { accumulate(points, 1); }
    /// Takes away points that have been added before.
    void remove(std::span<const FixedPoint> points) { accumulate(points, -1); }

    /// The plane of all that is in the voxel, nullptr where it is empty. Fits it if needed.
    const VoxelPlane* find(VoxelIndex index);
    /// find() in two steps, between which the processor fetches the plane: where() for all of some points, then
    /// plane_at() for each. @return kNowhere where the voxel is empty; holds until points are added or removed
    std::uint32_t where(VoxelIndex index);
    const VoxelPlane& plane_at(std::uint32_t place);
    static constexpr std::uint32_t kNowhere = ~std::uint32_t{0};
    /// Of the voxel's flat facets the one that faces most nearly where `normal` (unit) points; nullptr: none faces that
    /// half of all directions.
    const VoxelPlane* find_facet(VoxelIndex index, const float normal[3]);

    /// Calls f(index, plane) for each occupied voxel of the 3 x 3 x 3 around `center`.
    template <class F>
    void for_each_around(VoxelIndex center, F&& f);

    VoxelIndex index_of(const FixedPoint& p) const;
    /// Side of a voxel as it is used: a whole number of kMapUnit_m.
    double voxel_m() const { return static_cast<double>(side_) * kMapUnit_m; }
    std::size_t size() const { return voxel_count_; }

  private:
    struct Moments {
        std::int32_t points = 0;
        std::int32_t weight = 0;               ///< of all points
        std::array<std::int64_t, 3> sum{};     ///< of positions relative to the voxel's centre
        std::array<std::int64_t, 6> square{};  ///< xx, xy, xz, yy, yz, zz, with the discs' own
    };
    static constexpr std::uint32_t kNone = kNowhere;
    /// The six sides that a surface may face, and one for points without a normal.
    static constexpr std::size_t kFacets = 7;
    static constexpr std::size_t kNoNormal = 6;
    struct Voxel {
        std::array<std::uint32_t, kFacets> facet;  ///< slots, kNone where there is none
        std::int32_t facets = 0;
    };
    static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
    static constexpr int kBlockBits = 2;  ///< a block has 2^kBlockBits voxels a side
    static constexpr std::size_t kBlockVoxels = std::size_t{1} << (3 * kBlockBits);
    struct Entry {
        std::uint64_t key = kEmpty;
        std::uint32_t block = kNone;
    };
    struct Block {
        std::array<std::uint32_t, kBlockVoxels> slot;  ///< by voxel, kNone where it is empty
        std::uint64_t occupied = 0;                    ///< bit by voxel
    };

    static std::uint64_t key_of(VoxelIndex index);
    static std::size_t position_in_block(VoxelIndex index);
    std::size_t home_of(std::uint64_t key) const;
    std::size_t locate(std::uint64_t key) const;  ///< entry of the key, or the empty entry where it would go
    std::uint32_t block_of(std::uint64_t key);    ///< kNone where there is none
    std::uint32_t make_block(std::uint64_t key);
    static std::size_t facet_of(const FixedPoint& p);
    std::uint32_t make_voxel();
    std::uint32_t make_facet();
    std::uint32_t voxel_at(VoxelIndex index);  ///< kNone where it is empty
    void accumulate(std::span<const FixedPoint> points, int sign);
    void erase_block(std::uint64_t key);
    void grow();
    void fit(const Moments& moments, VoxelPlane& plane) const;
    void fit_facet(std::uint32_t slot);
    void fit_voxel(std::uint32_t slot);

    VoxelMapConfig config_;
    std::int32_t side_;
    std::int64_t disc_;         ///< variance of a disc along its plane, fixed point squared
    std::vector<Entry> table_;  ///< open addressing, linear probing, a power of two long
    std::vector<Block> blocks_;
    std::vector<std::uint32_t> free_blocks_;
    std::size_t block_count_ = 0;
    std::uint64_t last_key_ = kEmpty;  ///< of the block that was asked for last
    std::uint32_t last_block_ = kNone;
    std::vector<Voxel> voxels_;               ///< by slot
    std::vector<VoxelPlane> voxel_planes_;    ///< by slot
    std::vector<std::uint32_t> free_voxels_;  ///< slots
    std::vector<Moments> facets_;             ///< by slot of its own
    std::vector<VoxelPlane> facet_planes_;    ///< likewise
    std::vector<std::uint32_t> free_facets_;  ///< likewise
    std::size_t voxel_count_ = 0;
};

inline std::uint64_t VoxelMap::key_of(VoxelIndex i) {
    constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
    const auto part = [&](std::int32_t v) {
        return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v >> kBlockBits)) & kMask;
    };
    return (part(i.x) << 42) | (part(i.y) << 21) | part(i.z);
}

inline std::size_t VoxelMap::position_in_block(VoxelIndex i) {
    constexpr std::uint32_t kMask = (1U << kBlockBits) - 1;
    const auto part = [&](std::int32_t v) { return static_cast<std::size_t>(static_cast<std::uint32_t>(v) & kMask); };
    return (part(i.z) << (2 * kBlockBits)) | (part(i.y) << kBlockBits) | part(i.x);
}

inline std::size_t VoxelMap::home_of(std::uint64_t key) const {
    const int bits = std::countr_zero(table_.size());
    return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> (64 - bits));
}

inline std::size_t VoxelMap::locate(std::uint64_t key) const {
    const std::size_t mask = table_.size() - 1;
    std::size_t i = home_of(key);
    while (table_[i].key != key && table_[i].key != kEmpty) i = (i + 1) & mask;
    return i;
}

inline std::uint32_t VoxelMap::block_of(std::uint64_t key) {
    if (key != last_key_) {
        last_key_ = key;
        last_block_ = table_[locate(key)].block;
    }
    return last_block_;
}

inline std::uint32_t VoxelMap::voxel_at(VoxelIndex index) {
    const std::uint32_t block = block_of(key_of(index));
    return block == kNone ? kNone : blocks_[block].slot[position_in_block(index)];
}

inline std::uint32_t VoxelMap::where(VoxelIndex index) {
    const std::uint32_t slot = voxel_at(index);
    if (slot != kNone) __builtin_prefetch(&voxel_planes_[slot]);
    return slot;
}

inline const VoxelPlane& VoxelMap::plane_at(std::uint32_t place) {
    if (!voxel_planes_[place].fitted) fit_voxel(place);
    return voxel_planes_[place];
}

inline const VoxelPlane* VoxelMap::find(VoxelIndex index) {
    const std::uint32_t slot = voxel_at(index);
    return slot == kNone ? nullptr : &plane_at(slot);
}

template <class F>
void VoxelMap::for_each_around(VoxelIndex center, F&& f) {
    constexpr int kSide = 1 << kBlockBits;
    static_assert(kSide == 4, "the masks below are for 64 voxels a block");
    // Bits of the voxels in a block whose coordinate along one axis lies in [low, high].
    const auto layers = [](int low, int high, int stride, std::uint64_t layer) {
        std::uint64_t mask = 0;
        for (int i = std::max(low, 0); i <= std::min(high, kSide - 1); ++i) mask |= layer << (i * stride);
        return mask;
    };
    for (int bz = (center.z - 1) >> kBlockBits; bz <= (center.z + 1) >> kBlockBits; ++bz) {
        const std::uint64_t in_z = layers(center.z - 1 - bz * kSide, center.z + 1 - bz * kSide, 16, 0xFFFFULL);
        for (int by = (center.y - 1) >> kBlockBits; by <= (center.y + 1) >> kBlockBits; ++by) {
            const std::uint64_t in_y =
                in_z & layers(center.y - 1 - by * kSide, center.y + 1 - by * kSide, 4, 0x000F000F000F000FULL);
            for (int bx = (center.x - 1) >> kBlockBits; bx <= (center.x + 1) >> kBlockBits; ++bx) {
                const std::uint32_t block = block_of(key_of({bx * kSide, by * kSide, bz * kSide}));
                if (block == kNone) continue;
                std::uint64_t left =
                    blocks_[block].occupied & in_y &
                    layers(center.x - 1 - bx * kSide, center.x + 1 - bx * kSide, 1, 0x1111111111111111ULL);
                for (; left != 0; left &= left - 1) {
                    const int bit = std::countr_zero(left);
                    const VoxelIndex index{bx * kSide + (bit & 3), by * kSide + ((bit >> 2) & 3),
                                           bz * kSide + (bit >> 4)};
                    const std::uint32_t slot = blocks_[block].slot[static_cast<std::size_t>(bit)];
                    f(index, plane_at(slot));
                }
            }
        }
    }
}

}  // namespace dlod
