#include "driver/pcap_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <span>

#include "driver/network_address.hpp"

namespace dlod::driver {
namespace {

constexpr std::uint32_t kNanosecondMagic = 0xA1B23C4D;
constexpr std::uint32_t kSnapshotLength = 262144;
constexpr std::uint32_t kLinkEthernet = 1;

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::size_t kFileHeader = 24;
constexpr std::size_t kRecordHeader = 16;
constexpr std::size_t kEthernetHeader = 14;
constexpr std::size_t kIpv4Header = 20;
constexpr std::size_t kIpv6Header = 40;
constexpr std::size_t kIpv6FragmentHeader = 8;
constexpr std::size_t kUdpHeader = 8;
constexpr std::size_t kLargestPayload = 65535 - kIpv4Header - kUdpHeader;
constexpr std::uint8_t kTimeToLive = 64;
constexpr std::uint8_t kIpv6Fragment = 44;
constexpr int kSmallestMtu = 256;
constexpr int kLargestMtu = 65535;

/// Appends big-endian (network) and host-order values to memory that was reserved before.
class Cursor {
  public:
    explicit Cursor(std::byte* at) : at_(at) {}

    void u8(unsigned v) { *at_++ = static_cast<std::byte>(v); }
    void u16(unsigned v) {
        u8(v >> 8);
        u8(v & 0xFF);
    }
    void u32(std::uint32_t v) {
        u16(v >> 16);
        u16(v & 0xFFFF);
    }
    void host32(std::uint32_t v) { bytes(std::as_bytes(std::span(&v, 1))); }
    void host16(std::uint16_t v) { bytes(std::as_bytes(std::span(&v, 1))); }
    void bytes(Bytes b) {
        std::copy(b.begin(), b.end(), at_);
        at_ += b.size();
    }
    std::byte* at() const { return at_; }

  private:
    std::byte* at_;
};

}  // namespace

/// What all fragments of a datagram share.
struct PcapWriter::Datagram {
    IpAddress source;
    IpAddress destination;
    bool ipv4 = true;
    bool fragmented = false;
    std::uint32_t id = 0;
    std::int64_t time_ns = 0;
    std::array<std::byte, kUdpHeader> udp{};
    Bytes payload;

    std::size_t length() const { return udp.size() + payload.size(); }
    std::size_t ip_header() const { return ipv4 ? kIpv4Header : kIpv6Header + (fragmented ? kIpv6FragmentHeader : 0); }
};

PcapWriter::PcapWriter(const std::filesystem::path& path, const PcapWriterOptions& options)
    : path_(path), options_(options), buffer_(std::make_unique_for_overwrite<std::byte[]>(kBufferBytes)) {
    options_.mtu = std::clamp(options_.mtu, kSmallestMtu, kLargestMtu);
    file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file_ < 0) {
        fail("cannot be created", errno);
        return;
    }
    Cursor c(buffer_.get());
    c.host32(kNanosecondMagic);
    c.host16(2);  // version 2.4
    c.host16(4);
    c.host32(0);  // times are UTC
    c.host32(0);
    c.host32(kSnapshotLength);
    c.host32(kLinkEthernet);
    buffered_ = kFileHeader;
}

PcapWriter::~PcapWriter() {
    flush();
    if (file_ >= 0) ::close(file_);
}

bool PcapWriter::fail(const char* what, int error_number) noexcept {
    try {
        error_ = path_.string() + ": " + what + ": " + std::strerror(error_number);
    } catch (...) {
        error_ = "out of memory";  // short enough to need none
    }
    buffered_ = 0;
    return false;
}

bool PcapWriter::flush() noexcept {
    if (!ok()) return false;
    std::size_t done = 0;
    while (done < buffered_) {
        const ssize_t n = ::write(file_, buffer_.get() + done, buffered_ - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            const int error_number = n < 0 ? errno : EIO;
            // Back to the last flush, which ended with a whole record. What is no file has nothing to cut.
            [[maybe_unused]] const int cut = ::ftruncate(file_, static_cast<off_t>(flushed_));
            return fail("cannot be written", error_number);
        }
        done += static_cast<std::size_t>(n);
    }
    flushed_ += buffered_;
    buffered_ = 0;
    return true;
}

bool PcapWriter::write(const Packet& packet) noexcept {
    if (!ok()) return false;
    if (packet.data.size() > kLargestPayload) return false;

    Datagram d;
    d.ipv4 = is_ipv4(packet.sender_address) || is_unspecified(packet.sender_address);
    d.destination = d.ipv4 ? options_.destination_ipv4 : options_.destination_ipv6;
    d.source = is_unspecified(packet.sender_address) ? d.destination : packet.sender_address;
    d.id = next_id_++;
    d.time_ns = packet.receive_ns;
    d.payload = packet.data;
    const auto mtu = static_cast<std::size_t>(options_.mtu);
    d.fragmented = d.ip_header() + d.length() > mtu;

    const std::size_t step = d.fragmented ? (mtu - d.ip_header()) / 8 * 8 : d.length();
    const std::size_t fragments = (d.length() + step - 1) / step;
    const std::size_t headers = kRecordHeader + kEthernetHeader + d.ip_header();
    if (buffered_ + fragments * headers + d.length() > kBufferBytes && !flush()) return false;

    Cursor udp(d.udp.data());
    udp.u16(packet.sender_port);
    udp.u16(packet.destination_port);
    udp.u16(static_cast<unsigned>(d.length()));
    // The header has an even length: the sums of header and payload add.
    const auto pseudo = udp_pseudo_header_sum(d.source, d.destination, static_cast<std::uint32_t>(d.length()));
    const unsigned sum = internet_checksum(d.payload, internet_checksum(d.udp, pseudo));
    udp.u16(sum == 0xFFFF ? sum : ~sum & 0xFFFF);  // 0 would mean that there is none

    for (std::size_t begin = 0; begin < d.length(); begin += step) {
        append_fragment(d, begin, std::min(begin + step, d.length()));
    }
    return true;
}

void PcapWriter::append_fragment(const Datagram& d, std::size_t begin, std::size_t end) noexcept {
    const std::size_t size = end - begin;
    const auto frame = static_cast<std::uint32_t>(kEthernetHeader + d.ip_header() + size);
    const unsigned more = end < d.length() ? 1 : 0;

    Cursor c(buffer_.get() + buffered_);
    c.host32(static_cast<std::uint32_t>(d.time_ns / 1'000'000'000));
    c.host32(static_cast<std::uint32_t>(d.time_ns % 1'000'000'000));
    c.host32(frame);
    c.host32(frame);

    // Locally administered addresses, receiver and sender.
    c.bytes(std::as_bytes(std::span("\x02\0\0\0\0\1\x02\0\0\0\0\2", 12)));
    if (d.ipv4) {
        c.u16(0x0800);
        std::byte* header = c.at();
        c.u16(0x4500);
        c.u16(static_cast<unsigned>(kIpv4Header + size));
        c.u16(d.id & 0xFFFF);
        c.u16(static_cast<unsigned>(begin / 8) | (more << 13));
        c.u8(kTimeToLive);
        c.u8(kProtocolUdp);
        Cursor checksum = c;
        c.u16(0);
        c.bytes(Bytes(d.source).last(4));
        c.bytes(Bytes(d.destination).last(4));
        checksum.u16(~unsigned{internet_checksum(Bytes(header, kIpv4Header))} & 0xFFFF);
    } else {
        c.u16(0x86DD);
        c.u32(0x60000000);
        c.u16(static_cast<unsigned>(d.ip_header() - kIpv6Header + size));
        c.u8(d.fragmented ? kIpv6Fragment : kProtocolUdp);
        c.u8(kTimeToLive);
        c.bytes(d.source);
        c.bytes(d.destination);
        if (d.fragmented) {
            c.u16(unsigned{kProtocolUdp} << 8);
            c.u16(static_cast<unsigned>(begin) | more);
            c.u32(d.id);
        }
    }
    if (begin == 0) c.bytes(d.udp);
    const std::size_t from = begin == 0 ? 0 : begin - kUdpHeader;
    c.bytes(d.payload.subspan(from, end - kUdpHeader - from));
    buffered_ = static_cast<std::size_t>(c.at() - buffer_.get());
}

}  // namespace dlod::driver
