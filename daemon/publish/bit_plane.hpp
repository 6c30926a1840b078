#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace dlod::daemon {

/// Packs `labels == value` into bits, most significant first: pixel i is bit 7 - i % 8 of byte i / 8.
/// @param bits (labels.size() + 7) / 8 bytes
void pack_bit_plane(std::span<const std::uint8_t> labels, std::uint8_t value, std::span<std::uint8_t> bits);

}  // namespace dlod::daemon
