#include "daemon/publish/bit_plane.hpp"

#include <bit>
#include <cstring>

namespace dlod::daemon {

void pack_bit_plane(std::span<const std::uint8_t> labels, std::uint8_t value, std::span<std::uint8_t> bits) {
    static_assert(std::endian::native == std::endian::little);
    constexpr std::uint64_t kEachByte = 0x0101010101010101;
    constexpr std::uint64_t kLow7 = 0x7f * kEachByte;
    const std::uint64_t pattern = value * kEachByte;
    const std::size_t whole = labels.size() / 8;
    for (std::size_t i = 0; i < whole; ++i) {
        // Eight labels at once: a byte that equals the value becomes 0, a zero byte becomes 1, others 0.
        std::uint64_t x = 0;
        std::memcpy(&x, labels.data() + 8 * i, 8);
        x ^= pattern;
        x = (~(((x & kLow7) + kLow7) | x | kLow7)) >> 7;
        // Byte k's bit is multiplied to bit 63 - k; all other products fall outside of the top byte.
        bits[i] = static_cast<std::uint8_t>((x * 0x8040201008040201) >> 56);
    }
    if (labels.size() % 8 == 0) return;
    std::uint8_t last = 0;
    for (std::size_t i = 8 * whole; i < labels.size(); ++i) {
        if (labels[i] == value) last = static_cast<std::uint8_t>(last | (0x80U >> (i % 8)));
    }
    bits[whole] = last;
}

}  // namespace dlod::daemon
