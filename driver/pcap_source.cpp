#include "driver/pcap_source.hpp"

#include <pcap/pcap.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace dlod::driver {
namespace {

/// Damaged captures have times that nanoseconds in 64 bits cannot hold.
constexpr std::int64_t kLatestSecond = std::int64_t{1} << 32;

/// A few packets a system call; it stays in the cache.
constexpr std::size_t kFileBuffer_bytes = 128 << 10;

/// Records from one look at the file position to the next.
constexpr std::uint64_t kProgressRecords = 64;

std::string link_type_name(int link_type) {
    const char* name = pcap_datalink_val_to_name(link_type);
    return std::to_string(link_type) + (name != nullptr ? std::string(" (") + name + ")" : "");
}

}  // namespace

PcapSource::PcapSource(const std::filesystem::path& path, PcapOptions options)
    : path_(path),
      options_(std::move(options)),
      file_buffer_(std::make_unique_for_overwrite<char[]>(kFileBuffer_bytes)),
      pcap_(nullptr, pcap_close),
      reassembly_(options_.reassembly) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) throw SourceError(path.string() + ": is a folder, not a capture");
    std::FILE* file = std::fopen(path.c_str(), "rbe");
    if (file == nullptr) throw SourceError(path.string() + ": cannot be opened: " + std::strerror(errno));
    std::setvbuf(file, file_buffer_.get(), _IOFBF, kFileBuffer_bytes);
    file_size_ = std::filesystem::file_size(path, error);
    if (error) file_size_ = 0;

    std::array<char, PCAP_ERRBUF_SIZE> message{};
    pcap_.reset(pcap_fopen_offline_with_tstamp_precision(file, PCAP_TSTAMP_PRECISION_NANO, message.data()));
    if (pcap_ == nullptr) {
        std::fclose(file);
        throw SourceError(path.string() + ": is no pcap or pcapng capture: " + message.data());
    }
    link_type_ = pcap_datalink(pcap_.get());
    if (!link_type_supported(link_type_)) {
        throw SourceError(path.string() + ": link type " + link_type_name(link_type_) +
                          " is not supported; Ethernet, Linux cooked, raw IP and loopback captures are");
    }
}

PcapSource::~PcapSource() = default;

PacketBatch PcapSource::next() {
    while (!stopped_.load(std::memory_order_relaxed)) {
        if (ended_) return {.status = SourceStatus::kEnd, .packets = {}};
        pcap_pkthdr* header = nullptr;
        const u_char* bytes = nullptr;
        const int result = pcap_next_ex(pcap_.get(), &header, &bytes);
        if (result != 1) return finish(result);
        ++counters_.records;
        if (counters_.records.value() % kProgressRecords == 0) note_progress();
        // Nanosecond precision was asked for: tv_usec has nanoseconds.
        const std::int64_t seconds = std::clamp<std::int64_t>(header->ts.tv_sec, 0, kLatestSecond);
        const std::int64_t time_ns = seconds * 1'000'000'000 + header->ts.tv_usec;
        if (take_record(std::as_bytes(std::span(bytes, header->caplen)), header->len, time_ns)) {
            ++counters_.delivered;
            return {.status = SourceStatus::kPackets, .packets = std::span(&packet_, 1)};
        }
    }
    return {.status = SourceStatus::kStopped, .packets = {}};
}

PacketBatch PcapSource::finish(int result) {
    ended_ = true;
    bytes_read_.set(file_size_);
    reassembly_.finish();
    if (result == PCAP_ERROR) {
        ++counters_.unreadable;
        const long at = std::ftell(pcap_file(pcap_.get()));
        warn(path_.string() + ": the capture is cut off or damaged after record " +
             std::to_string(counters_.records.value()) + ", near byte " + std::to_string(at) + " of " +
             std::to_string(file_size_) + " (" + pcap_geterr(pcap_.get()) + "); everything before was delivered");
    }
    if (counters_.records.value() == 0) warn(path_.string() + ": the capture has no packets");
    const auto& r = reassembly_.counters();
    if (r.reassembled.value() == 0 && r.fragments.value() > 0) {
        warn(path_.string() + ": has " + std::to_string(r.fragments.value()) +
             " IP fragments, but not one whole datagram: it was probably captured with a filter on ports, which only "
             "the first fragment passes");
    }
    if (counters_.cut_short.value() > 0) {
        warn(
            path_.string() + ": " + std::to_string(counters_.cut_short.value()) +
            " packets were cut short when they were captured; record with an unlimited snapshot length (tcpdump -s 0)");
    }
    return {.status = SourceStatus::kEnd, .packets = {}};
}

bool PcapSource::take_record(Bytes frame, std::uint32_t original_length, std::int64_t time_ns) {
    const NetworkLayer layer = strip_link_layer(link_type_, frame);
    IpPacket ip;
    if (layer.fault == IpFault::kNone) {
        ip = parse_ip(layer.ip);
    } else {
        ip.fault = layer.fault;
    }
    switch (ip.fault) {
        case IpFault::kNone:
            break;
        case IpFault::kNotIp:
            ++counters_.not_ip;
            return false;
        case IpFault::kTruncated:
            ++(frame.size() < original_length ? counters_.cut_short : counters_.malformed);
            return false;
        case IpFault::kMalformed:
            ++counters_.malformed;
            return false;
    }
    if (!ip.fragment()) return take_datagram(ip, ip.payload, false, time_ns);
    const Bytes datagram = reassembly_.add(ip, layer.vlan, time_ns);
    return !datagram.empty() && take_datagram(ip, datagram, true, time_ns);
}

bool PcapSource::take_datagram(const IpPacket& ip, Bytes datagram, bool reassembled, std::int64_t time_ns) {
    std::uint8_t protocol = ip.protocol;
    if (reassembled && !skip_ipv6_extensions(protocol, datagram)) {
        ++counters_.malformed;
        return false;
    }
    if (protocol != kProtocolUdp) {
        ++counters_.not_udp;
        return false;
    }
    const auto port = peek_destination_port(datagram);
    if (port && !options_.ports.empty() &&
        std::find(options_.ports.begin(), options_.ports.end(), *port) == options_.ports.end()) {
        ++counters_.other_port;
        return false;
    }
    const auto udp = parse_udp(ip.source, ip.destination, datagram);
    // Nothing is left over behind a reassembled datagram unless it was put together from two.
    const bool fits = udp && (!reassembled || udp->length == datagram.size());
    const bool wrong = fits && reassembled && udp->checksum == UdpChecksum::kWrong;
    if (reassembled && (!fits || wrong)) reassembly_.refuse(time_ns);
    if (!fits) {
        ++counters_.malformed;
        return false;
    }
    // Where an id was in use by two, only a right checksum tells that the datagram is one of them.
    if (wrong || (reassembled && reassembly_.contested() && udp->checksum != UdpChecksum::kRight)) {
        ++counters_.checksum_wrong;
        return false;
    }
    // Captured whole, it can be nothing but this one datagram; what is damaged in it the frame builder finds.
    if (udp->checksum == UdpChecksum::kWrong) ++counters_.checksum_ignored;
    packet_.data = udp->payload;
    packet_.receive_ns = time_ns;
    packet_.sender_address = ip.source;
    packet_.sender_port = udp->source_port;
    packet_.destination_port = udp->destination_port;
    return true;
}

void PcapSource::note_progress() {
    const off_t at = ::ftello(pcap_file(pcap_.get()));
    if (at > 0) bytes_read_.set(static_cast<std::uint64_t>(at));
}

double PcapSource::progress() const {
    if (file_size_ == 0) return 0.0;
    return std::min(1.0, static_cast<double>(bytes_read_.value()) / static_cast<double>(file_size_));
}

void PcapSource::visit_counters(const CounterVisitor& visit) const {
    visit("capture_records", counters_.records.value());
    visit("packets_delivered", counters_.delivered.value());
    visit("packets_other_port", counters_.other_port.value());
    visit("records_not_ip", counters_.not_ip.value());
    visit("packets_not_udp", counters_.not_udp.value());
    visit("packets_cut_short", counters_.cut_short.value());
    visit("packets_malformed", counters_.malformed.value());
    visit("packets_checksum_wrong", counters_.checksum_wrong.value());
    visit("packets_checksum_ignored", counters_.checksum_ignored.value());
    visit("capture_unreadable", counters_.unreadable.value());
    reassembly_.visit_counters(visit);
}

}  // namespace dlod::driver
