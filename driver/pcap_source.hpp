// UDP datagrams from a capture file.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "driver/ip_reassembly.hpp"
#include "driver/packet_source.hpp"

struct pcap;

namespace dlod::driver {

struct PcapOptions {
    std::vector<std::uint16_t> ports;  ///< destination ports to deliver; all when empty
    ReassemblyLimits reassembly;
};

/// What became of the capture's records, one name each.
struct PcapCounters {
    Counter records;
    Counter delivered;         ///< datagrams handed out
    Counter other_port;        ///< UDP to a port that was not asked for
    Counter not_ip;            ///< ARP and the like
    Counter not_udp;           ///< TCP, ICMP and the like
    Counter cut_short;         ///< cut off by the snapshot length of the capture
    Counter malformed;         ///< IP or UDP headers that contradict themselves or the length
    Counter checksum_wrong;    ///< dropped: UDP's checksum tells that fragments did not belong together
    Counter checksum_ignored;  ///< captured whole and delivered with a wrong checksum
    Counter unreadable;        ///< 1 if the file ends in the middle of a record or becomes unreadable
};

/// Reads pcap and pcapng files (libpcap), micro- and nanosecond, of the link types of strip_link_layer, and yields
/// their UDP datagrams one by one, fragments reassembled, `receive_ns` being the capture time.
///
/// A wrong UDP checksum drops a reassembled datagram: it may be made of two. One that was captured whole is delivered
/// and counted: captures with addresses made anonymous, or taken before the network card filled the checksum in, are
/// still good, and what is damaged the frame builder finds.
class PcapSource final : public PacketSource {
  public:
    /// Throws SourceError naming the file if it cannot be opened, is no capture, or has a link type not supported.
    explicit PcapSource(const std::filesystem::path& path, PcapOptions options = {});
    ~PcapSource() override;

    PacketBatch next() override;
    void stop() noexcept override { stopped_.store(true, std::memory_order_relaxed); }
    void visit_counters(const CounterVisitor& visit) const override;

    const PcapCounters& counters() const { return counters_; }
    const ReassemblyCounters& reassembly_counters() const { return reassembly_.counters(); }

    /// Share of the file that was read, 0 to 1. From any thread.
    double progress() const;

  private:
    bool take_record(Bytes frame, std::uint32_t original_length, std::int64_t time_ns);
    bool take_datagram(const IpPacket& ip, Bytes datagram, bool reassembled, std::int64_t time_ns);
    PacketBatch finish(int result);
    void note_progress();

    std::filesystem::path path_;
    PcapOptions options_;
    std::unique_ptr<char[]> file_buffer_;  ///< of the file that pcap_ owns
    std::unique_ptr<pcap, void (*)(pcap*)> pcap_;
    int link_type_ = 0;
    std::uint64_t file_size_ = 0;
    bool ended_ = false;
    IpReassembly reassembly_;
    Packet packet_;
    PcapCounters counters_;
    Counter bytes_read_;  ///< of the file, brought up to date now and then
    std::atomic<bool> stopped_{false};
};

}  // namespace dlod::driver
