#include "driver/udp_source.hpp"

#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace dlod::driver {
namespace {

constexpr int kIpv6MulticastAll = 29;  // linux/in6.h, which does not go with netinet/in.h
constexpr int kRejoinAfterMs = 1000;
constexpr std::size_t kMostSockets = 8;

std::string reason() {
    return std::strerror(errno);
}

void enable(int fd, int level, int option, int value = 1) {
    ::setsockopt(fd, level, option, &value, sizeof value);
}

std::int64_t nanoseconds(const timespec& t) {
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

IpAddress address_option(const std::string& key, const std::string& text) {
    const auto address = parse_address(text);
    if (!address) throw SourceError(key + ": \"" + text + "\" is no IPv4 or IPv6 address");
    return *address;
}

/// True if the address is one of this host's.
bool is_local(const IpAddress& address) {
    const int family = is_ipv4(address) ? AF_INET : AF_INET6;
    const int fd = ::socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return false;
    const SocketAddress any_port = to_socket_address({address, 0}, family);
    const bool bound = ::bind(fd, any_port.get(), any_port.length) == 0;
    ::close(fd);
    return bound;
}

}  // namespace

/// Room for a receive stamp and the drop counter.
struct UdpSource::ControlBuffer {
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> bytes;
};

UdpSource::UdpSource(UdpOptions options) : options_(std::move(options)) {
    if (options_.ports.empty() || options_.ports.size() > kMostSockets) {
        throw SourceError("ports: 1 to " + std::to_string(kMostSockets) + " are possible, not " +
                          std::to_string(options_.ports.size()));
    }
    if (!options_.bind_address.empty()) bind_ = address_option("bind_address", options_.bind_address);
    for (const std::string& sender : options_.senders) senders_.push_back(address_option("senders", sender));
    if (!options_.multicast_group.empty()) {
        group_ = address_option("multicast_group", options_.multicast_group);
        if (!is_multicast(*group_)) {
            throw SourceError("multicast_group: " + options_.multicast_group +
                              " is no multicast address (224.0.0.0 to 239.255.255.255, or ff00::/8)");
        }
    }
    if (options_.share_ports && !group_) {
        throw SourceError(
            "share_ports: two programs can only share a port on a multicast group: set multicast_group and let the "
            "sensor send there, or set forward_to and let the other program read what is forwarded");
    }
    const bool ipv4 = group_ ? is_ipv4(*group_) : !options_.bind_address.empty() && is_ipv4(bind_);
    family_ = ipv4 ? AF_INET : AF_INET6;
    if (group_ && !options_.bind_address.empty() && is_ipv4(bind_) != ipv4) {
        throw SourceError("bind_address: " + options_.bind_address + " and multicast_group " +
                          options_.multicast_group + " must both be IPv4 or both IPv6");
    }

    options_.batch = std::clamp(options_.batch, static_cast<int>(kMostSockets), 1024);
    options_.largest_datagram = std::clamp(options_.largest_datagram, 64, 65536);
    const auto batch = static_cast<std::size_t>(options_.batch);
    const auto largest = static_cast<std::size_t>(options_.largest_datagram);
    memory_ = std::make_unique_for_overwrite<std::byte[]>(batch * largest);
    controls_ = std::make_unique<ControlBuffer[]>(batch);
    messages_.resize(batch);
    buffers_.resize(batch);
    addresses_.resize(batch);
    packets_.resize(batch);
    merged_.resize(batch);
    for (std::size_t i = 0; i < batch; ++i) {
        buffers_[i] = {memory_.get() + i * largest, largest};
        messages_[i] = {};
        messages_[i].msg_hdr.msg_iov = &buffers_[i];
        messages_[i].msg_hdr.msg_iovlen = 1;
    }

    granted_buffer_bytes_ = options_.receive_buffer_bytes;
    sockets_.reserve(options_.ports.size());
    try {
        for (const std::uint16_t port : options_.ports) {
            const bool open = port != 0 && std::any_of(sockets_.begin(), sockets_.end(),
                                                       [port](const Socket& s) { return s.port == port; });
            if (!open) open_socket(port);
        }
        if (!options_.forward_to.empty()) open_forwarder();
        for (std::size_t i = 0; i < sockets_.size(); ++i) {
            sockets_[i].room = batch / sockets_.size();
            sockets_[i].first = i * sockets_[i].room;
        }
    } catch (...) {
        for (const Socket& s : sockets_) ::close(s.fd);
        throw;
    }
    if (granted_buffer_bytes_ < options_.receive_buffer_bytes) {
        warn("receive buffer: the kernel grants " + std::to_string(granted_buffer_bytes_) + " of " +
             std::to_string(options_.receive_buffer_bytes) +
             " bytes, packets may be lost under load; allow it with: sysctl -w net.core.rmem_max=" +
             std::to_string(options_.receive_buffer_bytes));
    }
}

UdpSource::~UdpSource() {
    for (const Socket& s : sockets_) ::close(s.fd);
}

void UdpSource::open_socket(std::uint16_t port) {
    int fd = ::socket(family_, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0 && family_ == AF_INET6 && !group_ && options_.bind_address.empty()) {
        family_ = AF_INET;  // a kernel without IPv6
        fd = ::socket(family_, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    }
    if (fd < 0) throw SourceError("UDP port " + std::to_string(port) + ": no socket: " + reason());
    Socket& s = sockets_.emplace_back();
    s.fd = fd;
    if (family_ == AF_INET6) {
        const bool any = is_unspecified(bind_) && !group_;
        enable(fd, IPPROTO_IPV6, IPV6_V6ONLY, any ? 0 : 1);
    }
    if (options_.share_ports) {
        // Both: the kernel wants all readers of a port to agree, and others set the one or the other.
        enable(fd, SOL_SOCKET, SO_REUSEADDR);
        enable(fd, SOL_SOCKET, SO_REUSEPORT);
    }
    set_receive_buffer(s);
    enable(fd, SOL_SOCKET, SO_TIMESTAMPNS);
    enable(fd, SOL_SOCKET, SO_RXQ_OVFL);

    IpAddress address = bind_;
    if (family_ == AF_INET && options_.bind_address.empty()) address = ipv4_address(0, 0, 0, 0);
    const SocketAddress local = to_socket_address({address, port}, family_);
    const std::string where = "UDP port " + std::to_string(port) + " on " +
                              (options_.bind_address.empty() ? "all addresses" : options_.bind_address);
    if (::bind(fd, local.get(), local.length) != 0) {
        switch (errno) {
            case EADDRINUSE:
                throw SourceError(
                    where + " is in use by another program; find it with: ss -ulpn 'sport = :" + std::to_string(port) +
                    "'. Stop it, or let both read by multicast (share_ports) or forwarding (forward_to)");
            case EACCES:
                throw SourceError(where + ": ports below 1024 need CAP_NET_BIND_SERVICE; let the sensor send to a " +
                                  "higher one");
            case EADDRNOTAVAIL:
                break;
            default:
                throw SourceError(where + ": cannot be bound: " + reason());
        }
        // The address may come when the cable is plugged in.
        enable(fd, family_ == AF_INET ? static_cast<int>(IPPROTO_IP) : static_cast<int>(IPPROTO_IPV6),
               family_ == AF_INET ? IP_FREEBIND : IPV6_FREEBIND);
        if (::bind(fd, local.get(), local.length) != 0) throw SourceError(where + ": cannot be bound: " + reason());
        warn(where + ": no interface has this address yet; nothing is received until one has (see: ip address)");
    }
    sockaddr_storage bound{};
    socklen_t length = sizeof bound;
    ::getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &length);
    s.port = from_socket_address(bound).port;

    if (group_) {
        // Only groups that this socket joined, not those of other programs on this host.
        if (family_ == AF_INET) {
            enable(fd, IPPROTO_IP, IP_MULTICAST_ALL, 0);
        } else {
            enable(fd, IPPROTO_IPV6, kIpv6MulticastAll, 0);
        }
        std::string error;
        if (!join_group(s, error)) throw SourceError(error);
    }
}

void UdpSource::set_receive_buffer(const Socket& s) {
    const int wanted = options_.receive_buffer_bytes;
    // The kernel doubles what is asked for, to allow for its overhead, and reports the double.
    const auto granted = [&] {
        int bytes = 0;
        socklen_t length = sizeof bytes;
        ::getsockopt(s.fd, SOL_SOCKET, SO_RCVBUF, &bytes, &length);
        return bytes / 2;
    };
    if (granted() < wanted) enable(s.fd, SOL_SOCKET, SO_RCVBUFFORCE, wanted);
    if (granted() < wanted) enable(s.fd, SOL_SOCKET, SO_RCVBUF, wanted);
    granted_buffer_bytes_ = std::min(granted_buffer_bytes_, granted());
}

bool UdpSource::join_group(const Socket& s, std::string& error) const {
    const std::string& interface = options_.interface;
    unsigned index = interface.empty() ? 0 : ::if_nametoindex(interface.c_str());
    ip_mreqn ipv4{};
    if (index == 0 && !interface.empty()) {
        const auto address = parse_address(interface);
        if (!address || !is_ipv4(*address) || family_ != AF_INET) {
            error = "interface: there is no interface \"" + interface + "\" (see: ip link)";
            return false;
        }
        std::memcpy(&ipv4.imr_address, address->data() + 12, 4);
    }
    int result = 0;
    if (family_ == AF_INET) {
        std::memcpy(&ipv4.imr_multiaddr, group_->data() + 12, 4);
        ipv4.imr_ifindex = static_cast<int>(index);
        result = ::setsockopt(s.fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &ipv4, sizeof ipv4);
    } else {
        ipv6_mreq ipv6{};
        std::memcpy(&ipv6.ipv6mr_multiaddr, group_->data(), 16);
        ipv6.ipv6mr_interface = index;
        result = ::setsockopt(s.fd, IPPROTO_IPV6, IPV6_JOIN_GROUP, &ipv6, sizeof ipv6);
    }
    if (result == 0) return true;
    const int cause = errno;
    error = "multicast_group: " + options_.multicast_group + " cannot be joined" +
            (interface.empty() ? "" : " on " + interface) + ": " + std::strerror(cause);
    if (interface.empty()) error += "; set interface to the interface that the sensor is on";
    errno = cause;
    return false;
}

void UdpSource::renew_membership() {
    // An interface that was taken away and came back has lost its memberships. Those that still hold say EADDRINUSE.
    std::string error;
    for (const Socket& s : sockets_) {
        if (join_group(s, error)) ++counters_.rejoined;
    }
}

void UdpSource::open_forwarder() {
    const auto target = parse_endpoint(options_.forward_to);
    if (!target || is_unspecified(target->address)) {
        throw SourceError("forward_to: \"" + options_.forward_to + "\" is no address or address:port");
    }
    const bool own_port = target->port == 0 || std::any_of(sockets_.begin(), sockets_.end(),
                                                           [&](const Socket& s) { return s.port == target->port; });
    const bool own_group = group_ && *group_ == target->address;
    if (own_port && (own_group || is_local(target->address))) {
        throw SourceError("forward_to: " + options_.forward_to +
                          " is where this program listens itself; give another port or another host");
    }
    forwarder_ = std::make_unique<PacketForwarder>(*target);
}

std::vector<std::uint16_t> UdpSource::ports() const {
    std::vector<std::uint16_t> ports;
    for (const Socket& s : sockets_) ports.push_back(s.port);
    return ports;
}

void UdpSource::stop() noexcept {
    stopped_.store(true, std::memory_order_relaxed);
    stop_.set();
}

PacketBatch UdpSource::next() {
    if (stopped_.load(std::memory_order_relaxed)) return {.status = SourceStatus::kStopped, .packets = {}};

    const bool some_left =
        std::any_of(sockets_.begin(), sockets_.end(), [](const Socket& s) { return !s.received.empty(); });
    std::array<pollfd, kMostSockets + 1> polled{};
    for (std::size_t i = 0; i < sockets_.size(); ++i) polled[i] = {sockets_[i].fd, POLLIN, 0};
    polled[sockets_.size()] = {stop_.fd(), POLLIN, 0};
    const int ready = ::poll(polled.data(), sockets_.size() + 1, some_left ? 0 : options_.timeout_ms);
    if (polled[sockets_.size()].revents != 0) return {.status = SourceStatus::kStopped, .packets = {}};
    if (ready <= 0 && !some_left) {
        idle_ms_ += options_.timeout_ms;
        if (group_ && idle_ms_ >= kRejoinAfterMs) {
            idle_ms_ = 0;
            renew_membership();
        }
        return {.status = SourceStatus::kIdle, .packets = {}};
    }
    idle_ms_ = 0;

    for (std::size_t i = 0; i < sockets_.size(); ++i) {
        Socket& s = sockets_[i];
        if (!s.received.empty()) continue;
        s.more_may_wait = false;
        if (polled[i].revents == 0) continue;
        const std::size_t messages = receive(s, s.first, s.room);
        std::size_t count = 0;
        for (std::size_t m = s.first; m < s.first + messages; ++m) {
            if (take_message(s, messages_[m], packets_[s.first + count])) ++count;
        }
        s.received = std::span(packets_).subspan(s.first, count);
        // Nobody waits for a port at which only refused packets come.
        s.more_may_wait = messages == s.room && count > 0;
    }
    const std::span<const Packet> packets = merge_received();
    if (packets.empty()) return {.status = SourceStatus::kIdle, .packets = {}};
    counters_.delivered.add(packets.size());
    if (forwarder_) forwarder_->send(packets);
    return {.status = SourceStatus::kPackets, .packets = packets};
}

std::span<const Packet> UdpSource::merge_received() {
    // By stamps between the sockets, but never against the order of one socket: a clock that is set back, or stamps
    // that the kernel makes up late for what came before it had begun to stamp, must not reorder a sensor's packets.
    // What was read of one socket waits for what the other has not been read of: after a stall, the few IMU packets
    // would be seconds ahead of the lidar's.
    std::size_t count = 0;
    for (;;) {
        Socket* first = nullptr;
        for (Socket& s : sockets_) {
            if (s.received.empty() && s.more_may_wait) return std::span(merged_).first(count);
            if (s.received.empty()) continue;
            if (first == nullptr || s.received[0].receive_ns < first->received[0].receive_ns) first = &s;
        }
        if (first == nullptr) return std::span(merged_).first(count);
        merged_[count++] = first->received[0];
        first->received = first->received.subspan(1);
    }
}

std::size_t UdpSource::receive(Socket& s, std::size_t first, std::size_t room) {
    for (std::size_t i = first; i < first + room; ++i) {
        msghdr& header = messages_[i].msg_hdr;
        header.msg_name = &addresses_[i];
        header.msg_namelen = sizeof addresses_[i];
        header.msg_control = controls_[i].bytes.data();
        header.msg_controllen = controls_[i].bytes.size();
        header.msg_flags = 0;
    }
    const int received = ::recvmmsg(s.fd, &messages_[first], static_cast<unsigned>(room), MSG_DONTWAIT, nullptr);
    if (received >= 0) return static_cast<std::size_t>(received);
    if (errno != EAGAIN && errno != EINTR) ++counters_.socket_errors;
    return 0;
}

bool UdpSource::take_message(Socket& s, const mmsghdr& message, Packet& packet) {
    timespec stamp{};
    bool stamped = false;
    // CMSG_NXTHDR takes a mutable header.
    msghdr header = message.msg_hdr;
    for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
        if (c->cmsg_level != SOL_SOCKET) continue;
        if (c->cmsg_type == SCM_TIMESTAMPNS) {
            std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
            stamped = true;
        } else if (c->cmsg_type == SO_RXQ_OVFL) {
            std::uint32_t drops = 0;
            std::memcpy(&drops, CMSG_DATA(c), sizeof drops);
            counters_.kernel_drops.add(drops - s.kernel_drops);  // modulo 2^32
            s.kernel_drops = drops;
        }
    }
    if ((header.msg_flags & MSG_TRUNC) != 0) {
        ++counters_.truncated;
        return false;
    }
    const Endpoint sender = from_socket_address(*static_cast<const sockaddr_storage*>(header.msg_name));
    if (!senders_.empty() && std::find(senders_.begin(), senders_.end(), sender.address) == senders_.end()) {
        ++counters_.refused_sender;
        return false;
    }
    if (!stamped) ::clock_gettime(CLOCK_REALTIME, &stamp);
    packet.data = {static_cast<const std::byte*>(header.msg_iov->iov_base), message.msg_len};
    packet.receive_ns = nanoseconds(stamp);
    packet.sender_address = sender.address;
    packet.sender_port = sender.port;
    packet.destination_port = s.port;
    counters_.delivered_bytes.add(message.msg_len);
    return true;
}

void UdpSource::visit_counters(const CounterVisitor& visit) const {
    visit("packets_delivered", counters_.delivered.value());
    visit("packets_delivered_bytes", counters_.delivered_bytes.value());
    visit("packets_refused_sender", counters_.refused_sender.value());
    visit("packets_truncated", counters_.truncated.value());
    visit("packets_kernel_drops", counters_.kernel_drops.value());
    visit("socket_errors", counters_.socket_errors.value());
    visit("multicast_rejoined", counters_.rejoined.value());
    visit("packets_forwarded", forwarder_ ? forwarder_->sent().value() : 0);
    visit("packets_forward_failed", forwarder_ ? forwarder_->failed().value() : 0);
}

}  // namespace dlod::driver
