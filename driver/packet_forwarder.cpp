#include "driver/packet_forwarder.hpp"

#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "driver/packet_source.hpp"

namespace dlod::driver {
namespace {

constexpr std::size_t kBatch = 64;

}  // namespace

PacketForwarder::PacketForwarder(const Endpoint& target)
    : target_(target),
      family_(is_ipv4(target.address) ? AF_INET : AF_INET6),
      messages_(kBatch),
      buffers_(kBatch),
      addresses_(kBatch) {
    socket_ = ::socket(family_, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (socket_ < 0) {
        throw SourceError("forwarding to " + to_string(target) + ": no socket: " + std::strerror(errno));
    }
    // Room for a burst; without it a frame's worth of large packets would not be taken at once.
    const int bytes = 4 << 20;
    ::setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    for (std::size_t i = 0; i < kBatch; ++i) {
        messages_[i] = {};
        messages_[i].msg_hdr.msg_iov = &buffers_[i];
        messages_[i].msg_hdr.msg_iovlen = 1;
    }
}

PacketForwarder::~PacketForwarder() {
    ::close(socket_);
}

void PacketForwarder::send(std::span<const Packet> packets) noexcept {
    while (!packets.empty()) {
        const std::size_t n = std::min(packets.size(), kBatch);
        for (std::size_t i = 0; i < n; ++i) {
            const Packet& p = packets[i];
            buffers_[i] = {const_cast<std::byte*>(p.data.data()), p.data.size()};
            addresses_[i] =
                to_socket_address({target_.address, target_.port != 0 ? target_.port : p.destination_port}, family_);
            messages_[i].msg_hdr.msg_name = addresses_[i].get();
            messages_[i].msg_hdr.msg_namelen = addresses_[i].length;
        }
        std::size_t done = 0;
        while (done < n) {
            const int taken = ::sendmmsg(socket_, &messages_[done], static_cast<unsigned>(n - done), MSG_DONTWAIT);
            if (taken > 0) {
                done += static_cast<std::size_t>(taken);
                sent_.add(static_cast<std::uint64_t>(taken));
            } else if (errno != EINTR) {
                ++failed_;  // this one; the next may pass (nobody listened to the one before, say)
                ++done;
            }
        }
        packets = packets.subspan(n);
    }
}

}  // namespace dlod::driver
