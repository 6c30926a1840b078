// From a captured frame to the IP packet in it, and from an IP packet to the UDP datagram: headers only, no copies.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace dlod::driver {

using Bytes = std::span<const std::byte>;
using IpAddress = std::array<std::byte, 16>;  ///< IPv6, or IPv4 as ::ffff:a.b.c.d

inline constexpr std::uint8_t kProtocolUdp = 17;

/// Link types as libpcap numbers them (DLT_ values on Linux).
bool link_type_supported(int link_type);

/// Why a frame or packet gave nothing.
enum class IpFault {
    kNone,
    kNotIp,      ///< another protocol on the link, ARP say
    kTruncated,  ///< the capture's snapshot length cut it off
    kMalformed,  ///< lengths that contradict each other or a header that is not there
};

/// The network layer of one captured frame.
struct NetworkLayer {
    IpFault fault = IpFault::kNone;
    std::uint32_t vlan = 0;  ///< identifiers of up to two VLAN tags, 0 for none
    Bytes ip;                ///< from the IP header on, to the captured end
};

/// Strips the link header of `frame`: Ethernet and Linux cooked v1 and v2, each with any stack of VLAN tags, raw IP,
/// BSD null and loopback.
NetworkLayer strip_link_layer(int link_type, Bytes frame);

/// One IP packet, whole or a fragment. IPv4 options and IPv6 extension headers are skipped.
struct IpPacket {
    IpFault fault = IpFault::kNone;
    IpAddress source{};
    IpAddress destination{};
    std::uint8_t protocol = 0;  ///< of the payload
    std::uint32_t id = 0;       ///< identification of fragments
    std::uint32_t offset = 0;   ///< of the payload in the datagram, bytes
    bool more_fragments = false;
    Bytes payload;

    bool fragment() const { return more_fragments || offset != 0; }
};

IpPacket parse_ip(Bytes bytes);

/// IPv6 extension headers that were inside a reassembled datagram. Returns false when they are malformed.
bool skip_ipv6_extensions(std::uint8_t& protocol, Bytes& payload);

enum class UdpChecksum {
    kAbsent,  ///< the sender gave none
    kRight,
    kOffloaded,  ///< sum of the pseudo-header only: captured on the sender before its network card filled it in
    kWrong,
};

struct UdpDatagram {
    std::uint16_t source_port = 0;
    std::uint16_t destination_port = 0;
    std::uint16_t length = 0;  ///< as the header says: header and payload
    UdpChecksum checksum = UdpChecksum::kAbsent;
    Bytes payload;
};

/// Destination port of a UDP datagram, unverified; nothing if there is no header.
std::optional<std::uint16_t> peek_destination_port(Bytes datagram);

/// Parses the UDP header at the start of `datagram` and verifies the checksum; nothing if the lengths do not fit.
std::optional<UdpDatagram> parse_udp(const IpAddress& source, const IpAddress& destination, Bytes datagram);

/// Ones' complement sum of 16-bit big-endian words (RFC 1071), not inverted, folded to 16 bits, in host order.
std::uint16_t internet_checksum(Bytes bytes, std::uint32_t initial = 0);

/// The sum of UDP's pseudo-header, folded. `length`: header and payload. IPv4 where both addresses are mapped ones.
std::uint16_t udp_pseudo_header_sum(const IpAddress& source, const IpAddress& destination, std::uint32_t length);

bool is_ipv4(const IpAddress& address);

/// a.b.c.d as ::ffff:a.b.c.d
IpAddress ipv4_address(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d);

/// ::1
IpAddress ipv6_loopback();

}  // namespace dlod::driver
