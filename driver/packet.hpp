// A datagram as the sources hand it over: bytes, when and where it came from. What is inside is packet_format's
// concern.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace dlod::driver {

/// One whole UDP datagram. The bytes belong to the source and live until its next batch is asked for.
struct Packet {
    std::span<const std::byte> data;             ///< UDP payload
    std::int64_t receive_ns = 0;                 ///< CLOCK_REALTIME of the kernel's receipt; capture time in replay
    std::array<std::byte, 16> sender_address{};  ///< IPv6; IPv4 as ::ffff:a.b.c.d
    std::uint16_t sender_port = 0;               ///< host byte order
    std::uint16_t destination_port = 0;          ///< host byte order
};

}  // namespace dlod::driver
