#include "driver/network_address.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

namespace dlod::driver {

std::optional<IpAddress> parse_address(std::string_view text) {
    const std::string terminated(text);
    IpAddress address{};
    if (inet_pton(AF_INET6, terminated.c_str(), address.data()) == 1) return address;
    address = ipv4_address(0, 0, 0, 0);
    if (inet_pton(AF_INET, terminated.c_str(), address.data() + 12) == 1) return address;
    return std::nullopt;
}

std::string to_string(const IpAddress& address) {
    std::array<char, INET6_ADDRSTRLEN> text{};
    const bool ipv4 = is_ipv4(address);
    inet_ntop(ipv4 ? AF_INET : AF_INET6, address.data() + (ipv4 ? 12 : 0), text.data(), text.size());
    return text.data();
}

bool is_multicast(const IpAddress& address) {
    if (is_ipv4(address)) return (address[12] & std::byte{0xF0}) == std::byte{0xE0};
    return address[0] == std::byte{0xFF};
}

bool is_unspecified(const IpAddress& address) {
    return std::all_of(address.begin() + (is_ipv4(address) ? 12 : 0), address.end(),
                       [](std::byte b) { return b == std::byte{0}; });
}

std::optional<Endpoint> parse_endpoint(std::string_view text) {
    std::string_view host = text;
    std::string_view port;
    if (text.starts_with('[')) {
        const auto close = text.find(']');
        if (close == std::string_view::npos) return std::nullopt;
        host = text.substr(1, close - 1);
        port = text.substr(close + 1);
    } else if (std::count(text.begin(), text.end(), ':') == 1) {
        host = text.substr(0, text.find(':'));
        port = text.substr(text.find(':'));
    }
    const auto address = parse_address(host);
    if (!address) return std::nullopt;
    Endpoint endpoint{*address, 0};
    if (port.empty()) return endpoint;
    const char* const end = port.data() + port.size();
    const auto parsed = std::from_chars(port.data() + 1, end, endpoint.port);
    if (port[0] != ':' || parsed.ec != std::errc{} || parsed.ptr != end || endpoint.port == 0) return std::nullopt;
    return endpoint;
}

std::string to_string(const Endpoint& endpoint) {
    const std::string host = to_string(endpoint.address);
    return (is_ipv4(endpoint.address) ? host : "[" + host + "]") + ":" + std::to_string(endpoint.port);
}

SocketAddress to_socket_address(const Endpoint& endpoint, int family) {
    SocketAddress result;
    if (family == AF_INET) {
        sockaddr_in a{};
        a.sin_family = AF_INET;
        a.sin_port = htons(endpoint.port);
        std::memcpy(&a.sin_addr, endpoint.address.data() + 12, 4);
        std::memcpy(&result.storage, &a, sizeof a);
        result.length = sizeof a;
    } else {
        sockaddr_in6 a{};
        a.sin6_family = AF_INET6;
        a.sin6_port = htons(endpoint.port);
        std::memcpy(&a.sin6_addr, endpoint.address.data(), 16);
        std::memcpy(&result.storage, &a, sizeof a);
        result.length = sizeof a;
    }
    return result;
}

Endpoint from_socket_address(const sockaddr_storage& storage) {
    Endpoint endpoint;
    if (storage.ss_family == AF_INET) {
        sockaddr_in a{};
        std::memcpy(&a, &storage, sizeof a);
        endpoint.address = ipv4_address(0, 0, 0, 0);
        std::memcpy(endpoint.address.data() + 12, &a.sin_addr, 4);
        endpoint.port = ntohs(a.sin_port);
    } else if (storage.ss_family == AF_INET6) {
        sockaddr_in6 a{};
        std::memcpy(&a, &storage, sizeof a);
        std::memcpy(endpoint.address.data(), &a.sin6_addr, 16);
        endpoint.port = ntohs(a.sin6_port);
    }
    return endpoint;
}

std::optional<IpAddress> source_address_for(const SocketAddress& target) {
    const int fd = ::socket(target.storage.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return std::nullopt;
    sockaddr_storage here{};
    socklen_t length = sizeof here;
    // The kernel only looks up the route.
    const bool routed = ::connect(fd, target.get(), target.length) == 0 &&
                        ::getsockname(fd, reinterpret_cast<sockaddr*>(&here), &length) == 0;
    const int reason = errno;
    ::close(fd);
    errno = reason;
    if (!routed) return std::nullopt;
    return from_socket_address(here).address;
}

}  // namespace dlod::driver
