#include "driver/ip_packet.hpp"

#include <gtest/gtest.h>

#include "driver/network_address.hpp"
#include "tests/support/network_bytes.hpp"

namespace dlod::driver {
namespace {

using test::ByteVector;
using test::Checksum;
using test::IpFields;
using test::payload_pattern;
using test::UdpFields;

ByteVector copy(Bytes bytes) {
    return {bytes.begin(), bytes.end()};
}

TEST(IpPacket, Ipv4WithAndWithoutOptions) {
    const ByteVector data = payload_pattern(100, 1);
    for (const int words : {0, 1, 10}) {
        const ByteVector bytes = test::ip(data, {.id = 77, .option_words = words});
        const IpPacket p = parse_ip(bytes);
        ASSERT_EQ(p.fault, IpFault::kNone);
        EXPECT_EQ(copy(p.payload), data);
        EXPECT_EQ(p.id, 77U);
        EXPECT_EQ(p.protocol, kProtocolUdp);
        EXPECT_FALSE(p.fragment());
        EXPECT_EQ(to_string(p.source), "10.0.0.7");
        EXPECT_EQ(to_string(p.destination), "10.0.0.1");
    }
}

TEST(IpPacket, LinkPaddingIsLeftOff) {
    ByteVector bytes = test::ip(payload_pattern(10, 1));
    bytes.resize(60);
    EXPECT_EQ(copy(parse_ip(bytes).payload), payload_pattern(10, 1));
}

TEST(IpPacket, Ipv4Fragments) {
    const auto fragments = test::ip_fragments(payload_pattern(4000, 1), {.id = 5});
    ASSERT_EQ(fragments.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        const IpPacket p = parse_ip(fragments[i]);
        ASSERT_EQ(p.fault, IpFault::kNone);
        EXPECT_TRUE(p.fragment());
        EXPECT_EQ(p.offset, 1480 * i);
        EXPECT_EQ(p.more_fragments, i < 2);
    }
}

TEST(IpPacket, Ipv6WithExtensionsAndFragments) {
    // Hop-by-hop (8 bytes), routing (16), destination options (8).
    ByteVector extensions;
    test::put_big(extensions, 43, 1);
    test::put_big(extensions, 0, 7);
    test::put_big(extensions, 60, 1);
    test::put_big(extensions, 1, 1);
    extensions.resize(24);
    ByteVector to_udp = extensions;
    test::put_big(to_udp, 17, 1);
    test::put_big(to_udp, 0, 7);
    const ByteVector data = payload_pattern(100, 1);
    const IpPacket whole = parse_ip(test::ip(data, {.ipv6 = true, .extensions = to_udp}));
    ASSERT_EQ(whole.fault, IpFault::kNone);
    EXPECT_EQ(whole.protocol, kProtocolUdp);

    ByteVector to_fragment = extensions;
    test::put_big(to_fragment, 44, 1);
    test::put_big(to_fragment, 0, 7);
    const ByteVector bytes =
        test::ip(data, {.ipv6 = true, .id = 0x12345678, .offset = 1480, .more = true, .extensions = to_fragment});
    const IpPacket p = parse_ip(bytes);
    ASSERT_EQ(p.fault, IpFault::kNone);
    EXPECT_TRUE(p.fragment());
    EXPECT_EQ(p.id, 0x12345678U);
    EXPECT_EQ(p.offset, 1480U);
    EXPECT_EQ(copy(p.payload), data);
    EXPECT_EQ(to_string(p.source), "fd00::7");

    const ByteVector atomic = test::ip(data, {.ipv6 = true, .fragment_header = true});
    EXPECT_FALSE(parse_ip(atomic).fragment());
    EXPECT_EQ(copy(parse_ip(atomic).payload), data);
}

TEST(IpPacket, EveryTruncationIsAFault) {
    for (const bool ipv6 : {false, true}) {
        const ByteVector bytes = test::ip(payload_pattern(64, 1), {.ipv6 = ipv6, .offset = 8, .more = true});
        for (std::size_t n = 0; n < bytes.size(); ++n) {
            EXPECT_EQ(parse_ip(Bytes(bytes).first(n)).fault, IpFault::kTruncated) << n;
        }
        EXPECT_EQ(parse_ip(bytes).fault, IpFault::kNone);
    }
}

TEST(IpPacket, ContradictionsAreMalformed) {
    ByteVector bytes = test::ip(payload_pattern(64, 1));
    ByteVector bad = bytes;
    bad[0] = std::byte{0x44};  // a header of 16 bytes
    EXPECT_EQ(parse_ip(bad).fault, IpFault::kMalformed);
    bad = bytes;
    bad[0] = std::byte{0x55};
    EXPECT_EQ(parse_ip(bad).fault, IpFault::kMalformed);
    bad = bytes;
    bad[2] = std::byte{0};
    bad[3] = std::byte{19};  // shorter than its header
    EXPECT_EQ(parse_ip(bad).fault, IpFault::kMalformed);
    // An IPv6 extension that reaches beyond the packet.
    ByteVector extension;
    test::put_big(extension, 17, 1);
    test::put_big(extension, 255, 1);
    extension.resize(8);
    bytes = test::ip(payload_pattern(64, 1), {.ipv6 = true, .extensions = extension, .first_extension = 60});
    EXPECT_EQ(parse_ip(bytes).fault, IpFault::kMalformed);
}

TEST(LinkLayer, EveryLinkTypeLeadsToTheSamePacket) {
    for (const bool ipv6 : {false, true}) {
        const ByteVector packet = test::ip(payload_pattern(64, 1), {.ipv6 = ipv6});
        for (const int link : {0, 1, 12, 101, 108, 113, ipv6 ? 229 : 228, 276}) {
            ASSERT_TRUE(link_type_supported(link));
            const ByteVector frame = test::link_frame(link, packet);
            const NetworkLayer layer = strip_link_layer(link, frame);
            EXPECT_EQ(layer.fault, IpFault::kNone) << link;
            EXPECT_EQ(copy(layer.ip), packet) << link;
            EXPECT_EQ(layer.vlan, 0U);
        }
        for (const int link : {1, 113, 276}) {
            const auto one = test::link_frame(link, packet, {5});
            const auto two = test::link_frame(link, packet, {5, 6});
            const auto other = test::link_frame(link, packet, {6, 5});
            EXPECT_EQ(copy(strip_link_layer(link, one).ip), packet) << link;
            EXPECT_EQ(copy(strip_link_layer(link, two).ip), packet) << link;
            EXPECT_NE(strip_link_layer(link, one).vlan, strip_link_layer(link, two).vlan);
            EXPECT_NE(strip_link_layer(link, other).vlan, strip_link_layer(link, two).vlan);
        }
    }
    EXPECT_FALSE(link_type_supported(105));
}

TEST(LinkLayer, OtherProtocolsAndTruncations) {
    ByteVector frame = test::link_frame(1, test::ip(payload_pattern(64, 1)), {3, 4});
    for (std::size_t n = 0; n < 22; ++n) {
        EXPECT_EQ(strip_link_layer(1, Bytes(frame).first(n)).fault, IpFault::kTruncated) << n;
    }
    frame[20] = std::byte{0x08};
    frame[21] = std::byte{0x06};  // ARP
    EXPECT_EQ(strip_link_layer(1, frame).fault, IpFault::kNotIp);
    const ByteVector other_family{std::byte{99}, {}, {}, {}, std::byte{0x45}};
    EXPECT_EQ(strip_link_layer(0, other_family).fault, IpFault::kNotIp);
}

TEST(Udp, ChecksumsAreToldApart) {
    for (const bool ipv6 : {false, true}) {
        for (const std::size_t size : {0U, 1U, 2U, 3U, 48U, 8448U, 33025U}) {
            const ByteVector data = payload_pattern(size, 3);
            const IpPacket p = parse_ip(test::ip({std::byte{0}}, {.ipv6 = ipv6}));
            const auto of = [&](Checksum c) {
                const ByteVector bytes = test::udp(data, {.ipv6 = ipv6, .checksum = c});
                const auto udp = parse_udp(p.source, p.destination, bytes);
                EXPECT_TRUE(udp);
                EXPECT_EQ(copy(udp->payload), data);
                EXPECT_EQ(udp->source_port, 50000);
                EXPECT_EQ(udp->destination_port, 7502);
                return udp->checksum;
            };
            EXPECT_EQ(of(Checksum::kRight), UdpChecksum::kRight) << size;
            EXPECT_EQ(of(Checksum::kNone), UdpChecksum::kAbsent) << size;
            EXPECT_EQ(of(Checksum::kOffloaded), UdpChecksum::kOffloaded) << size;
            EXPECT_EQ(of(Checksum::kWrong), UdpChecksum::kWrong) << size;
        }
    }
}

TEST(Udp, AnyChangedByteIsSeen) {
    const IpPacket p = parse_ip(test::ip({std::byte{0}}));
    ByteVector bytes = test::udp(payload_pattern(101, 3));
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        if (i == 4 || i == 5) continue;  // the length, which must fit anyway
        bytes[i] ^= std::byte{0x10};
        EXPECT_EQ(parse_udp(p.source, p.destination, bytes)->checksum, UdpChecksum::kWrong) << i;
        bytes[i] ^= std::byte{0x10};
    }
}

TEST(Udp, LengthsMustFit) {
    const IpPacket p = parse_ip(test::ip({std::byte{0}}));
    const ByteVector data = payload_pattern(16, 1);
    EXPECT_FALSE(parse_udp(p.source, p.destination, test::udp(data, {.length_error = 1})));
    EXPECT_FALSE(parse_udp(p.source, p.destination, test::udp(data, {.length_error = -17})));
    EXPECT_TRUE(parse_udp(p.source, p.destination, test::udp(data, {.length_error = -1})));
    const ByteVector bytes = test::udp(data);
    for (std::size_t n = 0; n < bytes.size(); ++n) {
        EXPECT_FALSE(parse_udp(p.source, p.destination, Bytes(bytes).first(n))) << n;
    }
}

}  // namespace
}  // namespace dlod::driver
