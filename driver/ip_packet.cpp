#include "driver/ip_packet.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/types/multiversion.hpp"

namespace dlod::driver {
namespace {

// LINKTYPE_RAW (101) in a file becomes DLT_RAW (12) in libpcap on Linux; both are accepted.
constexpr int kLinkNull = 0;
constexpr int kLinkEthernet = 1;
constexpr int kLinkRaw = 12;
constexpr int kLinkRawInFile = 101;
constexpr int kLinkLoop = 108;
constexpr int kLinkCooked = 113;
constexpr int kLinkIpv4 = 228;
constexpr int kLinkIpv6 = 229;
constexpr int kLinkCooked2 = 276;

constexpr std::uint16_t kEtherIpv4 = 0x0800;
constexpr std::uint16_t kEtherIpv6 = 0x86DD;

constexpr std::size_t kUdpHeader = 8;
constexpr std::size_t kIpv6Header = 40;

std::uint8_t u8(Bytes b, std::size_t at) {
    return std::to_integer<std::uint8_t>(b[at]);
}

std::uint16_t u16(Bytes b, std::size_t at) {
    return static_cast<std::uint16_t>((u8(b, at) << 8) | u8(b, at + 1));
}

std::uint32_t u32(Bytes b, std::size_t at) {
    return (std::uint32_t{u16(b, at)} << 16) | u16(b, at + 2);
}

bool is_vlan(std::uint16_t ether_type) {
    return ether_type == 0x8100 || ether_type == 0x88A8 || ether_type == 0x9100 || ether_type == 0x9200;
}

NetworkLayer fault(IpFault f) {
    return NetworkLayer{.fault = f, .vlan = 0, .ip = {}};
}

/// Follows VLAN tags from the ether type at `type_at`; the layer above starts at `header`.
NetworkLayer behind_ether_type(Bytes frame, std::size_t type_at, std::size_t header) {
    if (frame.size() < header) return fault(IpFault::kTruncated);
    std::uint16_t type = u16(frame, type_at);
    NetworkLayer layer;
    while (is_vlan(type)) {
        if (frame.size() < header + 4) return fault(IpFault::kTruncated);
        layer.vlan = (layer.vlan << 12) | (u16(frame, header) & 0x0FFFU);
        type = u16(frame, header + 2);
        header += 4;
    }
    if (type != kEtherIpv4 && type != kEtherIpv6) return fault(IpFault::kNotIp);
    layer.ip = frame.subspan(header);
    return layer;
}

/// Null and loopback links: a 4-byte address family in the byte order of the capturing host.
NetworkLayer behind_family(Bytes frame) {
    if (frame.size() < 4) return fault(IpFault::kTruncated);
    std::uint32_t family = u32(frame, 0);
    if (family > 0xFFFF) family = __builtin_bswap32(family);
    // AF_INET, and AF_INET6 of Linux, Windows, NetBSD and OpenBSD, FreeBSD, macOS.
    constexpr std::array<std::uint32_t, 6> kIpFamilies{2, 10, 23, 24, 28, 30};
    if (std::find(kIpFamilies.begin(), kIpFamilies.end(), family) == kIpFamilies.end()) return fault(IpFault::kNotIp);
    return NetworkLayer{.fault = IpFault::kNone, .vlan = 0, .ip = frame.subspan(4)};
}

IpAddress mapped_ipv4(Bytes four) {
    return ipv4_address(u8(four, 0), u8(four, 1), u8(four, 2), u8(four, 3));
}

IpPacket ip_fault(IpFault f) {
    IpPacket p;
    p.fault = f;
    return p;
}

IpPacket parse_ipv4(Bytes b) {
    if (b.size() < 20) return ip_fault(IpFault::kTruncated);
    const std::size_t header = std::size_t{u8(b, 0) & 0x0FU} * 4;
    const std::size_t total = u16(b, 2);
    if (header < 20 || total < header) return ip_fault(IpFault::kMalformed);
    if (b.size() < total) return ip_fault(IpFault::kTruncated);
    IpPacket p;
    p.source = mapped_ipv4(b.subspan(12, 4));
    p.destination = mapped_ipv4(b.subspan(16, 4));
    p.protocol = u8(b, 9);
    p.id = u16(b, 4);
    const std::uint16_t fragment = u16(b, 6);
    p.offset = (fragment & 0x1FFFU) * 8U;
    p.more_fragments = (fragment & 0x2000U) != 0;
    p.payload = b.subspan(header, total - header);  // link padding behind `total` is left off
    return p;
}

bool is_extension(std::uint8_t next_header) {
    // Hop-by-hop, routing, authentication, destination options, mobility, HIP, shim6.
    return next_header == 0 || next_header == 43 || next_header == 51 || next_header == 60 || next_header == 135 ||
           next_header == 139 || next_header == 140;
}

IpPacket parse_ipv6(Bytes b) {
    constexpr std::uint8_t kFragmentHeader = 44;
    if (b.size() < kIpv6Header) return ip_fault(IpFault::kTruncated);
    const std::size_t length = u16(b, 4);
    if (length == 0) return ip_fault(IpFault::kMalformed);  // a jumbogram, or empty: neither is a sensor's
    if (b.size() < kIpv6Header + length) return ip_fault(IpFault::kTruncated);
    IpPacket p;
    std::copy_n(b.begin() + 8, 16, p.source.begin());
    std::copy_n(b.begin() + 24, 16, p.destination.begin());
    p.protocol = u8(b, 6);
    p.payload = b.subspan(kIpv6Header, length);
    if (!skip_ipv6_extensions(p.protocol, p.payload)) return ip_fault(IpFault::kMalformed);
    if (p.protocol != kFragmentHeader) return p;
    if (p.payload.size() < 8) return ip_fault(IpFault::kMalformed);
    p.protocol = u8(p.payload, 0);
    const std::uint16_t fragment = u16(p.payload, 2);
    p.offset = fragment & 0xFFF8U;
    p.more_fragments = (fragment & 1U) != 0;
    p.id = u32(p.payload, 4);
    p.payload = p.payload.subspan(8);
    // A whole packet in a fragment header ("atomic", RFC 6946): its own extensions follow.
    if (!p.fragment() && !skip_ipv6_extensions(p.protocol, p.payload)) return ip_fault(IpFault::kMalformed);
    return p;
}

DLOD_MULTIVERSION
std::uint64_t sum_of_words(std::size_t count, const std::byte* __restrict bytes) {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t word;
        std::memcpy(&word, bytes + 4 * i, 4);
        sum += word;
    }
    return sum;
}

}  // namespace

bool link_type_supported(int link_type) {
    switch (link_type) {
        case kLinkNull:
        case kLinkEthernet:
        case kLinkRaw:
        case kLinkRawInFile:
        case kLinkLoop:
        case kLinkCooked:
        case kLinkIpv4:
        case kLinkIpv6:
        case kLinkCooked2:
            return true;
        default:
            return false;
    }
}

NetworkLayer strip_link_layer(int link_type, Bytes frame) {
    switch (link_type) {
        case kLinkEthernet:
            return behind_ether_type(frame, 12, 14);
        case kLinkCooked:
            return behind_ether_type(frame, 14, 16);
        case kLinkCooked2:
            return behind_ether_type(frame, 0, 20);
        case kLinkNull:
        case kLinkLoop:
            return behind_family(frame);
        case kLinkRaw:
        case kLinkRawInFile:
        case kLinkIpv4:
        case kLinkIpv6:
            return NetworkLayer{.fault = IpFault::kNone, .vlan = 0, .ip = frame};
        default:
            return fault(IpFault::kNotIp);
    }
}

IpPacket parse_ip(Bytes bytes) {
    if (bytes.empty()) return ip_fault(IpFault::kTruncated);
    switch (u8(bytes, 0) >> 4) {
        case 4:
            return parse_ipv4(bytes);
        case 6:
            return parse_ipv6(bytes);
        default:
            return ip_fault(IpFault::kMalformed);
    }
}

bool skip_ipv6_extensions(std::uint8_t& protocol, Bytes& payload) {
    while (is_extension(protocol)) {
        if (payload.size() < 8) return false;
        // The authentication header counts in words of 4 bytes, all others in words of 8.
        const std::size_t length =
            protocol == 51 ? (std::size_t{u8(payload, 1)} + 2) * 4 : (std::size_t{u8(payload, 1)} + 1) * 8;
        if (payload.size() < length) return false;
        protocol = u8(payload, 0);
        payload = payload.subspan(length);
    }
    return true;
}

std::optional<std::uint16_t> peek_destination_port(Bytes datagram) {
    if (datagram.size() < kUdpHeader) return std::nullopt;
    return u16(datagram, 2);
}

std::optional<UdpDatagram> parse_udp(const IpAddress& source, const IpAddress& destination, Bytes datagram) {
    if (datagram.size() < kUdpHeader) return std::nullopt;
    UdpDatagram udp;
    udp.source_port = u16(datagram, 0);
    udp.destination_port = u16(datagram, 2);
    udp.length = u16(datagram, 4);
    if (udp.length < kUdpHeader || udp.length > datagram.size()) return std::nullopt;
    udp.payload = datagram.subspan(kUdpHeader, udp.length - kUdpHeader);
    const std::uint16_t stored = u16(datagram, 6);
    if (stored != 0) {
        const std::uint16_t pseudo = udp_pseudo_header_sum(source, destination, udp.length);
        if (internet_checksum(datagram.first(udp.length), pseudo) == 0xFFFF) {
            udp.checksum = UdpChecksum::kRight;
        } else {
            udp.checksum = stored == pseudo ? UdpChecksum::kOffloaded : UdpChecksum::kWrong;
        }
    }
    return udp;
}

std::uint16_t internet_checksum(Bytes bytes, std::uint32_t initial) {
    // Summed in host order, 32 bits at a time, and swapped once at the end: the sum does not depend on byte order.
    const std::size_t words = bytes.size() / 4;
    std::uint64_t sum = sum_of_words(words, bytes.data());
    if (const std::size_t rest = bytes.size() % 4; rest != 0) {
        std::uint32_t word = 0;
        std::memcpy(&word, bytes.data() + 4 * words, rest);
        sum += word;
    }
    while (sum >> 16 != 0) sum = (sum & 0xFFFF) + (sum >> 16);
    if constexpr (std::endian::native == std::endian::little) sum = __builtin_bswap16(static_cast<std::uint16_t>(sum));
    sum += initial;
    while (sum >> 16 != 0) sum = (sum & 0xFFFF) + (sum >> 16);
    return static_cast<std::uint16_t>(sum);
}

bool is_ipv4(const IpAddress& address) {
    return std::all_of(address.begin(), address.begin() + 10, [](std::byte b) { return b == std::byte{0}; }) &&
           address[10] == std::byte{0xFF} && address[11] == std::byte{0xFF};
}

IpAddress ipv4_address(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d) {
    IpAddress address{};
    address[10] = address[11] = std::byte{0xFF};
    address[12] = std::byte{a};
    address[13] = std::byte{b};
    address[14] = std::byte{c};
    address[15] = std::byte{d};
    return address;
}

IpAddress ipv6_loopback() {
    IpAddress address{};
    address[15] = std::byte{1};
    return address;
}

std::uint16_t udp_pseudo_header_sum(const IpAddress& source, const IpAddress& destination, std::uint32_t length) {
    const std::size_t skip = is_ipv4(source) && is_ipv4(destination) ? 12 : 0;
    const std::uint32_t rest = kProtocolUdp + (length >> 16) + (length & 0xFFFF);
    const std::uint16_t first = internet_checksum(Bytes(source).subspan(skip), rest);
    return internet_checksum(Bytes(destination).subspan(skip), first);
}

}  // namespace dlod::driver
