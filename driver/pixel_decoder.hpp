// The pixels of consecutive columns of a packet, straight into a frame's destaggered images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types/frame.hpp"
#include "driver/packet_format.hpp"

namespace dlod::driver {

/// How to cut a field out of a pixel's 32-bit word `word`: ((word >> right) & mask) << left.
struct FieldCut {
    std::size_t word = 0;
    std::uint32_t right = 0;
    std::uint32_t mask = 0;  ///< 0: the format lacks the field
    std::uint32_t left = 0;
};

/// A packet's columns are the image's rows: turned at once they would touch a cache line or two of each row of each
/// image for every packet, at addresses that share a few sets of the cache. So a few packets' columns are turned into a
/// stage that stays in the cache, and written from there in runs of whole lines.
class PixelDecoder {
  public:
    static constexpr std::size_t kStagedColumns = 64;

    PixelDecoder(const PacketLayout& layout, const SensorModel& sensor);

    /// Takes all rows of the packet's columns [first_column, first_column + count), which hold the measurements from
    /// `first_measurement` on; those must lie below the frame's width. The packet must have the layout's size. They are
    /// in the images after flush().
    void decode(std::span<const std::byte> packet, int first_column, int count, int first_measurement,
                RawImages& images);

    /// Writes what is staged; the images given to decode() must still be there.
    void flush();

    /// Writes zeros to all rows of `count` measurements from `first_measurement` on.
    void clear(int first_measurement, int count, RawImages& images) const;

  private:
    PacketLayout layout_;
    std::size_t width_;
    std::size_t pixel_words_;   ///< 32-bit words of a pixel in a packet
    std::size_t column_words_;  ///< of all rows
    std::vector<int> shift_;    ///< [rows] in 0 .. width - 1
    FieldCut range_, reflectivity_, signal_, near_ir_;

    AlignedVector<std::uint32_t> words_;  ///< [column words][kStagedColumns]
    std::size_t staged_ = 0;              ///< columns
    std::size_t first_staged_ = 0;        ///< measurement
    RawImages* images_ = nullptr;         ///< that the staged columns belong to
};

}  // namespace dlod::driver
