// The local map: a hash of voxels, each holding the moments of the surface elements inside it.
//
// Moments are integers in fixed point, so that adding and removing points is exact and independent of their order: a
// keyframe that leaves takes away precisely what it brought. A voxel's plane is fitted when it is first asked for.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types/image.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct VoxelMapConfig {
    double voxel_m = 0.5;
    double surfel_radius_m = 0.1;
    int min_points = 2;
    double max_thickness_m = 0.06;
    double noise_m = 0.006;

    template <class V>
    void visit(V& v) {
        v.parameter("voxel_m", voxel_m, Range{0.05, 5.0}, "m",
                    "side of a voxel; larger bridges sparser scans and rounds off detail");
        v.parameter("surfel_radius_m", surfel_radius_m, Range{0.0, 2.0}, "m",
                    "a point counts as a disc of this radius: its normal speaks while points are few");
        v.parameter("min_points", min_points, Range{1, 100}, "points", "a voxel with fewer has no plane");
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

struct VoxelIndex {
    std::int32_t x = 0, y = 0, z = 0;
    friend bool operator==(const VoxelIndex&, const VoxelIndex&) = default;
};

/// What the registration needs of a voxel, relative to the voxel's centre, metres.
struct VoxelPlane {
    float mean[3];
    float normal[3];
    float thickness_m;  ///< standard deviation along the normal, at least the configured floor
    float extent_m[2];  ///< standard deviations along the two tangents
    float tangent[3];   ///< direction of the larger extent
    bool flat;          ///< false: the normal means nothing
    std::uint32_t points;
};

class VoxelMap {
  public:
    explicit VoxelMap(const VoxelMapConfig& config);

    void clear();
    void add(std::span<const FixedPoint> points) { accumulate(points, 1); }
    /// Takes away points that have been added before.
    void remove(std::span<const FixedPoint> points) { accumulate(points, -1); }

    /// The voxel's plane, nullptr where it holds too few points. Fits it if needed.
    const VoxelPlane* find(VoxelIndex index);

    VoxelIndex index_of(const FixedPoint& p) const;
    /// Side of a voxel as it is used: a whole number of kMapUnit_m.
    double voxel_m() const { return static_cast<double>(side_) * kMapUnit_m; }
    std::size_t size() const { return voxel_count_; }

  private:
    struct Moments {
        std::int32_t count = 0;
        std::array<std::int32_t, 3> sum{};     ///< of positions relative to the voxel's centre
        std::array<std::int64_t, 6> square{};  ///< xx, xy, xz, yy, yz, zz, with the discs' own
    };
    struct Entry {
        std::uint64_t key = kEmpty;
        std::uint32_t slot = 0;
    };
    static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

    static std::uint64_t key_of(VoxelIndex index);
    std::size_t home_of(std::uint64_t key) const;
    void accumulate(std::span<const FixedPoint> points, int sign);
    std::size_t locate(std::uint64_t key) const;  ///< entry of the key, or the empty entry where it would go
    void erase(std::size_t entry);
    void grow();
    void fit(std::uint32_t slot);

    VoxelMapConfig config_;
    std::int32_t side_;
    std::int64_t disc_;         ///< variance of a disc along its plane, fixed point squared
    std::vector<Entry> table_;  ///< open addressing, linear probing, a power of two long
    std::vector<Moments> moments_;
    std::vector<VoxelPlane> planes_;
    std::vector<std::uint8_t> fitted_;
    std::vector<std::uint32_t> free_;
    std::size_t voxel_count_ = 0;
};

}  // namespace dlod
