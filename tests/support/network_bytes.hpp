// Packets and capture files byte by byte, written down apart from the code that they test.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace dlod::test {

using ByteVector = std::vector<std::byte>;

inline void put(ByteVector& out, const ByteVector& more) {
    out.insert(out.end(), more.begin(), more.end());
}

inline void put_big(ByteVector& out, std::uint64_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
}

inline void put_little(ByteVector& out, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
}

/// The same bytes as a key of ordered containers.
inline std::string key_of(const ByteVector& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Payload in which every byte depends on its place and on the datagram.
inline ByteVector payload_pattern(std::size_t size, std::uint32_t datagram) {
    ByteVector data(size);
    for (std::size_t i = 0; i < size; ++i) {
        const auto x = static_cast<std::uint32_t>(i) * 2654435761U ^ datagram * 40503U;
        data[i] = static_cast<std::byte>((x >> 13) ^ x);
    }
    return data;
}

/// Addresses as on the wire: 4 bytes (10.0.0.x) or 16 bytes (fd00::x).
inline ByteVector wire_address(bool ipv6, unsigned last) {
    ByteVector a(ipv6 ? 16 : 4);
    a[0] = static_cast<std::byte>(ipv6 ? 0xFD : 10);
    a.back() = static_cast<std::byte>(last);
    return a;
}

inline std::uint32_t plain_sum(const ByteVector& bytes) {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        sum += std::to_integer<std::uint32_t>(bytes[i]) << (i % 2 == 0 ? 8 : 0);
        sum = (sum & 0xFFFF) + (sum >> 16);
    }
    return sum;
}

enum class Checksum { kRight, kNone, kWrong, kOffloaded };

struct UdpFields {
    bool ipv6 = false;
    unsigned source = 7;  // last byte of the address
    unsigned destination = 1;
    std::uint16_t source_port = 50000;
    std::uint16_t port = 7502;
    Checksum checksum = Checksum::kRight;
    int length_error = 0;  // added to the header's length
};

/// UDP header and payload.
inline ByteVector udp(const ByteVector& payload, const UdpFields& f = {}) {
    const std::size_t length = 8 + payload.size();
    ByteVector pseudo = wire_address(f.ipv6, f.source);
    put(pseudo, wire_address(f.ipv6, f.destination));
    put_big(pseudo, 17, 4);
    put_big(pseudo, length, 4);
    ByteVector out;
    put_big(out, f.source_port, 2);
    put_big(out, f.port, 2);
    put_big(out, length + static_cast<std::size_t>(f.length_error), 2);
    put_big(out, 0, 2);
    put(out, payload);
    std::uint32_t checksum = 0;
    const std::uint32_t pseudo_sum = plain_sum(pseudo);
    if (f.checksum == Checksum::kOffloaded) checksum = pseudo_sum;
    if (f.checksum == Checksum::kRight || f.checksum == Checksum::kWrong) {
        ByteVector all = pseudo;
        put(all, out);
        checksum = ~plain_sum(all) & 0xFFFF;
        if (checksum == 0) checksum = 0xFFFF;
        if (f.checksum == Checksum::kWrong) checksum = checksum == 0x1234 ? 0x1235 : 0x1234;
    }
    out[6] = static_cast<std::byte>(checksum >> 8);
    out[7] = static_cast<std::byte>(checksum);
    return out;
}

struct IpFields {
    bool ipv6 = false;
    unsigned source = 7;
    unsigned destination = 1;
    std::uint8_t protocol = 17;
    std::uint32_t id = 1;
    std::size_t offset = 0;  // of a fragment, bytes
    bool more = false;
    bool fragment_header = false;  // IPv6: even if it is whole
    int option_words = 0;          // IPv4
    ByteVector extensions = {};    // IPv6: headers before the fragment header or payload, chained by the caller
    std::uint8_t first_extension = 0;
};

/// One IP packet around `payload`.
inline ByteVector ip(const ByteVector& payload, const IpFields& f = {}) {
    ByteVector out;
    if (!f.ipv6) {
        const auto header = static_cast<std::size_t>(20 + 4 * f.option_words);
        put_big(out, 0x40U + header / 4, 1);
        put_big(out, 0, 1);
        put_big(out, header + payload.size(), 2);
        put_big(out, f.id, 2);
        put_big(out, (f.more ? 0x2000U : 0U) | f.offset / 8, 2);
        put_big(out, 64, 1);
        put_big(out, f.protocol, 1);
        put_big(out, 0, 2);
        put(out, wire_address(false, f.source));
        put(out, wire_address(false, f.destination));
        put(out, ByteVector(static_cast<std::size_t>(4 * f.option_words), std::byte{1}));
    } else {
        const bool fragment = f.fragment_header || f.more || f.offset != 0;
        put_big(out, 0x60000000, 4);
        put_big(out, f.extensions.size() + (fragment ? 8 : 0) + payload.size(), 2);
        put_big(out, !f.extensions.empty() ? f.first_extension : fragment ? 44 : f.protocol, 1);
        put_big(out, 64, 1);
        put(out, wire_address(true, f.source));
        put(out, wire_address(true, f.destination));
        put(out, f.extensions);
        if (fragment) {
            put_big(out, f.protocol, 1);
            put_big(out, 0, 1);
            put_big(out, f.offset | (f.more ? 1U : 0U), 2);
            put_big(out, f.id, 4);
        }
    }
    put(out, payload);
    return out;
}

/// The IP fragments of a datagram, each with `step` bytes of it, the last with the rest.
inline std::vector<ByteVector> ip_fragments(const ByteVector& datagram, IpFields f, std::size_t step = 1480) {
    std::vector<ByteVector> all;
    for (std::size_t at = 0; at < datagram.size(); at += step) {
        const std::size_t end = std::min(at + step, datagram.size());
        f.offset = at;
        f.more = end < datagram.size();
        all.push_back(ip(ByteVector(datagram.begin() + static_cast<std::ptrdiff_t>(at),
                                    datagram.begin() + static_cast<std::ptrdiff_t>(end)),
                         f));
    }
    return all;
}

/// A link header of that libpcap link type around an IP packet, with VLAN tags (Ethernet and cooked links).
inline ByteVector link_frame(int link_type, const ByteVector& ip_packet, const std::vector<unsigned>& vlans = {}) {
    const unsigned version = std::to_integer<unsigned>(ip_packet[0]) >> 4;
    const std::uint64_t ether_type = version == 6 ? 0x86DD : 0x0800;
    ByteVector tags;  // from the first ether type on
    for (std::size_t i = 0; i < vlans.size(); ++i) {
        put_big(tags, i + 1 < vlans.size() ? 0x88A8 : 0x8100, 2);
        put_big(tags, vlans[i], 2);
    }
    put_big(tags, ether_type, 2);
    const ByteVector first_type(tags.begin(), tags.begin() + 2);
    const ByteVector behind(tags.begin() + 2, tags.end());
    ByteVector out;
    switch (link_type) {
        case 1:
            out.resize(12);
            put(out, tags);
            break;
        case 113:
            out.resize(14);
            put(out, first_type);
            put(out, behind);
            break;
        case 276:
            put(out, first_type);
            out.resize(20);
            put(out, behind);
            break;
        case 0:
            put_little(out, version == 6 ? 30 : 2, 4);
            break;
        case 108:
            put_big(out, version == 6 ? 24 : 2, 4);
            break;
        default:
            break;
    }
    put(out, ip_packet);
    return out;
}

/// One record of a capture.
struct Record {
    std::int64_t time_ns = 0;
    ByteVector frame;
    std::size_t cut = 0;  // bytes left out at the end, as by a snapshot length
};

enum class FileKind { kMicrosecond, kNanosecond, kMicrosecondSwapped, kNanosecondSwapped, kPcapng, kPcapngNanosecond };

/// A whole capture file.
inline ByteVector capture_file(FileKind kind, std::uint32_t link_type, const std::vector<Record>& records) {
    ByteVector out;
    if (kind == FileKind::kPcapng || kind == FileKind::kPcapngNanosecond) {
        const bool nano = kind == FileKind::kPcapngNanosecond;
        put_little(out, 0x0A0D0D0A, 4);  // section header
        put_little(out, 28, 4);
        put_little(out, 0x1A2B3C4D, 4);
        put_little(out, 1, 4);
        put_little(out, ~std::uint64_t{0}, 8);
        put_little(out, 28, 4);
        const std::uint64_t interface = nano ? 32 : 20;  // interface description
        put_little(out, 1, 4);
        put_little(out, interface, 4);
        put_little(out, link_type, 4);
        put_little(out, 262144, 4);
        if (nano) {
            put_little(out, 9, 2);  // if_tsresol, one byte: 10^-9
            put_little(out, 1, 2);
            put_little(out, 9, 4);
            put_little(out, 0, 4);
        }
        put_little(out, interface, 4);
        for (const Record& r : records) {
            const std::size_t captured = r.frame.size() - r.cut;
            const std::size_t padded = (captured + 3) / 4 * 4;
            const auto time = static_cast<std::uint64_t>(nano ? r.time_ns : r.time_ns / 1000);
            put_little(out, 6, 4);  // enhanced packet
            put_little(out, 32 + padded, 4);
            put_little(out, 0, 4);
            put_little(out, time >> 32, 4);
            put_little(out, time & 0xFFFFFFFF, 4);
            put_little(out, captured, 4);
            put_little(out, r.frame.size(), 4);
            put(out, ByteVector(r.frame.begin(), r.frame.end() - static_cast<std::ptrdiff_t>(r.cut)));
            out.resize(out.size() + padded - captured);
            put_little(out, 32 + padded, 4);
        }
        return out;
    }
    const bool swapped = kind == FileKind::kMicrosecondSwapped || kind == FileKind::kNanosecondSwapped;
    const bool nano = kind == FileKind::kNanosecond || kind == FileKind::kNanosecondSwapped;
    const auto number = [&](std::uint64_t value, int bytes) {
        swapped ? put_big(out, value, bytes) : put_little(out, value, bytes);
    };
    number(nano ? 0xA1B23C4D : 0xA1B2C3D4, 4);
    number(2, 2);
    number(4, 2);
    number(0, 8);
    number(262144, 4);
    number(link_type, 4);
    for (const Record& r : records) {
        number(static_cast<std::uint64_t>(r.time_ns / 1'000'000'000), 4);
        number(static_cast<std::uint64_t>(r.time_ns % 1'000'000'000) / (nano ? 1 : 1000), 4);
        number(r.frame.size() - r.cut, 4);
        number(r.frame.size(), 4);
        put(out, ByteVector(r.frame.begin(), r.frame.end() - static_cast<std::ptrdiff_t>(r.cut)));
    }
    return out;
}

/// A folder of its own that goes away with the test.
class ScratchFolder {
  public:
    ScratchFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "dlod_test_XXXXXX").string();
        if (::mkdtemp(name.data()) != nullptr) path_ = name;
    }
    ~ScratchFolder() {
        std::error_code ignored;
        if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    std::filesystem::path file(const std::string& name) const { return path_ / name; }

    std::filesystem::path write(const std::string& name, const ByteVector& bytes) const {
        std::ofstream out(file(name), std::ios::binary | std::ios::trunc);
        out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        return file(name);
    }

  private:
    std::filesystem::path path_;
};

/// Packets of a randomised test: DLOD_FUZZ_ITERATIONS, else `usual`.
inline int fuzz_packets(int usual) {
    const char* configured = std::getenv("DLOD_FUZZ_ITERATIONS");
    return configured != nullptr ? std::atoi(configured) : usual;
}

}  // namespace dlod::test
