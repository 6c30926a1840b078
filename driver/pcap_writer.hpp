// UDP datagrams as a capture file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "driver/ip_packet.hpp"
#include "driver/packet.hpp"

namespace dlod::driver {

struct PcapWriterOptions {
    int mtu = 65535;  ///< bytes of an IP packet, 256 to 65535; datagrams that do not fit are written as fragments
    IpAddress destination_ipv4 = ipv4_address(127, 0, 0, 1);  ///< packets do not carry their destination
    IpAddress destination_ipv6 = ipv6_loopback();
};

/// Writes a nanosecond pcap file of Ethernet, IPv4 or IPv6 (as the sender's address is) and UDP. Only whole packets
/// ever reach the file: if the disk is full, the part of one that was written is taken back. Nothing throws; after a
/// failure every call returns false and error() says why. Allocates only when it is opened.
class PcapWriter {
  public:
    /// Creates or replaces the file. Ask ok() whether that worked.
    explicit PcapWriter(const std::filesystem::path& path, const PcapWriterOptions& options = {});
    ~PcapWriter();
    PcapWriter(const PcapWriter&) = delete;
    PcapWriter& operator=(const PcapWriter&) = delete;

    /// Appends a datagram with the time stamp `receive_ns`; it may stay in memory until flush(). One that no UDP
    /// datagram can be (over 65507 bytes) is refused, without harm to the next.
    bool write(const Packet& packet) noexcept;

    /// Hands everything to the operating system.
    bool flush() noexcept;

    bool ok() const { return error_.empty(); }
    const std::string& error() const { return error_; }          ///< names the file
    std::uint64_t size() const { return flushed_ + buffered_; }  ///< bytes, with what flush() would write

  private:
    struct Datagram;
    void append_fragment(const Datagram& datagram, std::size_t begin, std::size_t end) noexcept;
    bool fail(const char* what, int error_number) noexcept;

    std::filesystem::path path_;
    PcapWriterOptions options_;
    int file_ = -1;
    std::unique_ptr<std::byte[]> buffer_;
    std::size_t buffered_ = 0;
    std::uint64_t flushed_ = 0;
    std::uint32_t next_id_ = 1;
    std::string error_;
};

}  // namespace dlod::driver
