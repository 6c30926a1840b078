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
    int word = 0;
    std::uint32_t right = 0;
    std::uint32_t mask = 0;  ///< 0: the format lacks the field
    std::uint32_t left = 0;
};

class PixelDecoder {
  public:
    PixelDecoder(const PacketLayout& layout, const SensorModel& sensor);

    /// Writes all rows of the packet's columns [first_column, first_column + count), which hold the measurements from
    /// `first_measurement` on; those must lie below the frame's width. The packet must have the layout's size.
    void decode(std::span<const std::byte> packet, int first_column, int count, int first_measurement,
                RawImages& images) const;

    /// Writes zeros to all rows of `count` measurements from `first_measurement` on.
    void clear(int first_measurement, int count, RawImages& images) const;

  private:
    PacketLayout layout_;
    int width_;
    std::vector<int> shift_;  ///< [rows] in 0 .. width - 1
    FieldCut range_, reflectivity_, signal_, near_ir_;
};

}  // namespace dlod::driver
