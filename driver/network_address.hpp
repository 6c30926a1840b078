// IP addresses as text and as the kernel takes them.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "driver/ip_packet.hpp"

namespace dlod::driver {

/// "192.168.1.7" or "fe80::1"; nothing if it is no address. Names are not looked up.
std::optional<IpAddress> parse_address(std::string_view text);

std::string to_string(const IpAddress& address);

bool is_multicast(const IpAddress& address);
bool is_unspecified(const IpAddress& address);

/// Address and port.
struct Endpoint {
    IpAddress address{};
    std::uint16_t port = 0;
};

/// "192.168.1.7:7502", "[fe80::1]:7502", or an address alone, which gives port 0.
std::optional<Endpoint> parse_endpoint(std::string_view text);

/// An IPv6 address in brackets.
std::string to_string(const Endpoint& endpoint);

/// A socket address and its length. An IPv4 address becomes AF_INET, or, for a dual-stack socket, AF_INET6.
struct SocketAddress {
    sockaddr_storage storage{};
    socklen_t length = 0;

    sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }
    const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

SocketAddress to_socket_address(const Endpoint& endpoint, int family);

/// The address and port in `storage`, IPv4 as a mapped address.
Endpoint from_socket_address(const sockaddr_storage& storage);

/// The address of this host from which datagrams to `target` leave; nothing, and errno, where no route leads there.
/// Nothing is sent.
std::optional<IpAddress> source_address_for(const SocketAddress& target);

}  // namespace dlod::driver
