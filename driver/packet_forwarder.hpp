// Passes received packets on to a second reader.
#pragma once

#include <sys/socket.h>

#include <vector>

#include "driver/counter.hpp"
#include "driver/network_address.hpp"
#include "driver/packet.hpp"

namespace dlod::driver {

/// Sends packets to another address as they came, from a port of its own. Never blocks: what the kernel does not take
/// at once is lost and counted.
class PacketForwarder {
  public:
    /// `port` 0 keeps each packet's destination port. Throws SourceError if the address cannot be used.
    explicit PacketForwarder(const Endpoint& target);
    ~PacketForwarder();
    PacketForwarder(const PacketForwarder&) = delete;
    PacketForwarder& operator=(const PacketForwarder&) = delete;

    void send(std::span<const Packet> packets) noexcept;

    const Counter& sent() const { return sent_; }
    const Counter& failed() const { return failed_; }

  private:
    Endpoint target_;
    int family_;
    int socket_ = -1;
    std::vector<mmsghdr> messages_;
    std::vector<iovec> buffers_;
    std::vector<SocketAddress> addresses_;
    Counter sent_;
    Counter failed_;
};

}  // namespace dlod::driver
