// What earlier frames saw, kept for free-space evidence: range images at spread ages with the pose of every column.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types/frame.hpp"

namespace dlod {

/// Range as references store it: 4 mm a unit, up to 262 m; 0 no return.
inline constexpr float kReferenceUnit_m = 0.004F;

/// One earlier frame.
struct Reference {
    /// Blocks of destaggered columns that share one pose: 1.6 ms at 10 Hz.
    static constexpr int kBlocks = 64;

    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();  ///< at its stamp
    std::vector<Eigen::Isometry3f> T_block_stamp;  ///< [kBlocks] stamp to the firing time of the block's middle
    std::vector<Eigen::Isometry3f>
        T_block_stamp_late;  ///< likewise where the block lies at the image's seam and was fired at the sweep's end
    AlignedVector<float> column_shift;  ///< [H] columns by which yaw within a block moves each row (pixel shift)
    /// Nearest return of a cell's window (low 16 bits) and farthest (high 16 bits), in units; 0 where too many of the
    /// window's pixels have no return. A cell is a few columns of one row, its window reaches half a cell further on
    /// both sides and some rows up and down. First the narrow cells, for far points, then
    /// the wide ones, for near points.
    AlignedVector<std::uint32_t> cells;
    std::int64_t stamp_ns = 0;
};

/// Keeps the last frame and about one in each octave of age (2, 4, 8 ... frames back), in constant memory. Frames in
/// order.
class ReferenceImages {
  public:
    /// @param levels octaves of age: the oldest reference is about 2^levels frames old
    ReferenceImages(const SensorModel& sensor, int levels);

    /// Remembers a frame whose odometry is valid. What select() gave before stays as it is until the next call.
    /// @return the frame as a reference
    const Reference& insert(const Frame& frame);
    void clear();

    /// References for the next frame, newest first, none twice.
    const std::vector<const Reference*>& select();

    /// Pixels a cell, a power of two: cell = pixel index >> bits.
    int narrow_bits() const { return narrow_bits_; }
    int wide_bits() const { return wide_bits_; }

  private:
    void fill_windows(const StructuredCloud& cloud, Reference& reference);
    void fill_poses(const Frame& frame, Reference& reference) const;

    SensorModel sensor_;
    int levels_;
    int narrow_bits_ = 0;
    int wide_bits_ = 0;
    double mean_shift_;
    std::uint64_t inserted_ = 0;
    std::vector<Reference> pool_;
    std::vector<int> users_;  ///< [pool] number of slots that hold it
    std::vector<int> slots_;  ///< [2 * levels] pool index of the two latest multiples of 2^level, -1 none
    std::vector<const Reference*> selected_;
    /// Extremes of the pixels of one row's windows; a border of one on both sides, for the image's seam.
    struct Windows {
        static constexpr std::size_t kBorder = 32;  // keeps rows aligned
        AlignedVector<std::uint16_t> low_values, high_values, missing_values;

        void resize(int width);
        /// Fills the border of n values.
        void wrap(int n);
        std::uint16_t* low() { return low_values.data() + kBorder; }
        std::uint16_t* high() { return high_values.data() + kBorder; }
        std::uint16_t* missing() { return missing_values.data() + kBorder; }
        const std::uint16_t* low() const { return low_values.data() + kBorder; }
        const std::uint16_t* high() const { return high_values.data() + kBorder; }
        const std::uint16_t* missing() const { return missing_values.data() + kBorder; }
    };

    /// @param rows of the image that a window covers
    void fill_cells(Windows& windows, int rows, int bits, std::uint32_t* cells);

    static constexpr int kRowsHigh = 3;  // windows of rows_
    Image<std::uint16_t> units_;         ///< ranges of the row being stacked and its neighbours, row r at r % kRowsHigh
    std::array<Windows, kRowsHigh> rows_;  ///< of the row at hand and its neighbours, likewise
    Windows joined_, halved_, halved_again_;
};

}  // namespace dlod
