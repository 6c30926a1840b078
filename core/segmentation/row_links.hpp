// Connections between the pixels of one row of the range image, and with those of the row above, as bits.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types/image.hpp"

namespace dlod {

/// Finds out what is connected, row by row from the top. Two neighbours in the image belong together when the farther
/// of their ranges is at most `ratio` times the nearer and they differ by at most `max_step_m`; range 0 belongs to
/// nothing. Bit c % 64 of word c / 64 stands for column c.
class RowLinks {
  public:
    explicit RowLinks(int width);

    /// Starts an image: there is no row above.
    void begin();
    /// Where the next row's ranges are to be put: [width], metres, 0 where the pixel belongs to nothing.
    float* next_row() { return rows_[current_ ^ 1].data() + kBorder; }
    /// Takes them. @param ratio_right for horizontal neighbours, @param ratio_down for this row and the one above
    void advance(float ratio_right, float ratio_down, float max_step_m);

    /// Columns in which a run of connected pixels begins, and in which one ends; runs do not pass the image's seam.
    const std::vector<std::uint64_t>& begins() const { return begins_[current_]; }
    const std::vector<std::uint64_t>& ends() const { return ends_; }
    /// Columns begins() of the row above.
    const std::vector<std::uint64_t>& begins_above() const { return begins_[current_ ^ 1]; }
    /// Columns in which a run is connected with one of the row above: at least one for each two runs that are.
    const std::vector<std::uint64_t>& joins() const { return joins_; }
    /// The last pixel is connected with the first.
    bool wraps() const { return wraps_; }

  private:
    static constexpr std::size_t kBorder = 16;  // keeps rows aligned

    int width_;
    int current_ = 0;  ///< of the pairs below, the row at hand; the other is the one above
    AlignedVector<float> rows_[2];
    std::vector<std::uint64_t> begins_[2];
    std::vector<std::uint64_t> ends_;
    std::vector<std::uint64_t> joins_;
    bool wraps_ = false;
    AlignedVector<std::uint8_t> used_, to_right_, to_above_;  ///< [64 * words] 0xFF: yes
};

}  // namespace dlod
