// How long the surface in a cell of the global map has stayed: what moves is gone before it is believed.
#pragma once

#include <cstdint>

namespace dlod {

/// When a cell was seen, in four bytes. Times are in tenths of a second modulo 2^15, about 55 minutes: only differences
/// that are far shorter are ever formed.
class Persistence {
  public:
    struct Rule {
        std::uint16_t confirm_ds = 0;  ///< a surface that stays this long is static
        std::uint16_t gap_ds = 0;      ///< not seen for longer: what is seen next is something new
    };

    Persistence() : Persistence(0, {}) {}
    Persistence(std::uint16_t now_ds, const Rule& rule)
        : first_(now_ds & kTimeMask), last_(first_), confirmed_(rule.confirm_ds == 0 ? 1U : 0U) {}

    /// The cell is seen at `now_ds`, not before the sighting before.
    void see(std::uint16_t now_ds, const Rule& rule) {
        if (confirmed_ != 0) return;
        if (since_last(now_ds) > rule.gap_ds) first_ = now_ds & kTimeMask;
        last_ = now_ds & kTimeMask;
        confirmed_ = span_ds() >= rule.confirm_ds ? 1U : 0U;
    }

    bool confirmed() const { return confirmed_ != 0; }
    /// Time between the first and the last sighting that belong together; meaningful until confirmed.
    std::uint16_t span_ds() const { return (last_ - first_) & kTimeMask; }
    std::uint16_t since_last(std::uint16_t now_ds) const { return (now_ds - last_) & kTimeMask; }

  private:
    static constexpr unsigned kTimeMask = 0x7FFF;

    std::uint32_t first_ : 15;
    std::uint32_t last_ : 15;
    std::uint32_t confirmed_ : 1;
};

}  // namespace dlod
