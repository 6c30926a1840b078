// UDP datagrams from the network.
#pragma once

#include <sys/socket.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "driver/network_address.hpp"
#include "driver/packet_forwarder.hpp"
#include "driver/packet_source.hpp"
#include "driver/stop_event.hpp"

namespace dlod::driver {

struct UdpOptions {
    std::vector<std::uint16_t> ports;    ///< one socket each: lidar, IMU; 0 lets the kernel choose
    std::string bind_address;            ///< of this host; empty: all of them, IPv4 and IPv6
    std::string multicast_group;         ///< joined if not empty
    std::string interface;               ///< its name or address; empty: as the routes say
    std::vector<std::string> senders;    ///< accepted source addresses; empty: any
    bool share_ports = false;            ///< let other programs read the same multicast group on the same ports
    std::string forward_to;              ///< "address" or "address:port" that gets a copy of every packet accepted
    int receive_buffer_bytes = 8 << 20;  ///< a socket; the kernel counts its overhead on top, about as much again
    int timeout_ms = 100;                ///< after which next() returns kIdle
    int batch = 64;                      ///< packets a call, at most; shared equally by the sockets
    int largest_datagram = 65536;        ///< bytes of memory a packet of the batch
};

/// What became of datagrams.
struct UdpCounters {
    Counter delivered;
    Counter delivered_bytes;
    Counter refused_sender;  ///< from an address that is not among the senders
    Counter truncated;       ///< larger than the memory for one; dropped
    Counter kernel_drops;    ///< lost by the kernel because its receive buffer was full
    Counter socket_errors;
    Counter rejoined;  ///< multicast memberships renewed after their interface had gone
};

/// Receives batches of datagrams on one or more ports, with the kernel's receive stamps, into memory that it reuses.
class UdpSource final : public PacketSource {
  public:
    /// Opens all sockets. Throws SourceError that names the option, address and port, and says what to do.
    explicit UdpSource(UdpOptions options);
    ~UdpSource() override;

    PacketBatch next() override;
    void stop() noexcept override;
    void visit_counters(const CounterVisitor& visit) const override;

    const UdpCounters& counters() const { return counters_; }

    /// The ports as bound, in the order of the options.
    std::vector<std::uint16_t> ports() const;

    /// The smallest receive buffer that the kernel granted a socket, in bytes as asked for.
    int receive_buffer_bytes() const { return granted_buffer_bytes_; }

  private:
    struct Socket {
        int fd = -1;
        std::uint16_t port = 0;
        std::uint32_t kernel_drops = 0;    ///< the kernel's running count
        std::size_t first = 0;             ///< of its share of the batch's memory
        std::size_t room = 0;              ///< and how many packets that holds
        std::span<const Packet> received;  ///< not yet handed out
        bool more_may_wait = false;        ///< the last time, all its room was filled
    };

    void open_socket(std::uint16_t port);
    void set_receive_buffer(const Socket& s);
    bool join_group(const Socket& s, std::string& error) const;
    void open_forwarder();
    std::size_t receive(Socket& s, std::size_t first, std::size_t room);
    bool take_message(Socket& s, const mmsghdr& message, Packet& packet);
    std::span<const Packet> merge_received();
    void renew_membership();

    UdpOptions options_;
    IpAddress bind_{};
    std::optional<IpAddress> group_;
    std::vector<IpAddress> senders_;
    int family_ = AF_INET6;
    int granted_buffer_bytes_ = 0;
    std::vector<Socket> sockets_;
    std::unique_ptr<PacketForwarder> forwarder_;
    StopEvent stop_;
    std::atomic<bool> stopped_{false};
    int idle_ms_ = 0;

    // The batch: memory, and what recvmmsg fills in.
    struct ControlBuffer;
    std::unique_ptr<std::byte[]> memory_;
    std::unique_ptr<ControlBuffer[]> controls_;
    std::vector<mmsghdr> messages_;
    std::vector<iovec> buffers_;
    std::vector<sockaddr_storage> addresses_;
    std::vector<Packet> packets_;  // socket by socket
    std::vector<Packet> merged_;   // as handed out
    UdpCounters counters_;
};

}  // namespace dlod::driver
