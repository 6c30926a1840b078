#include "daemon/publish/lcm_url.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <regex>

namespace dlod::daemon {
namespace {

constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";
constexpr std::uint16_t kDefaultPort = 7667;
constexpr std::string_view kTcpq = "tcpq://";
constexpr std::array<std::string_view, 5> kProviders = {"udpm://", "mpudpm://", kTcpq, "memq://", "file://"};

}  // namespace

std::string url_or_default(const std::string& url) {
    if (!url.empty()) return url;
    const char* const configured = std::getenv("LCM_DEFAULT_URL");
    return configured != nullptr && *configured != '\0' ? configured : kDefaultUrl;
}

bool has_lcm_provider(std::string_view url) {
    return std::any_of(kProviders.begin(), kProviders.end(),
                       [&](std::string_view provider) { return url.starts_with(provider); });
}

std::optional<LcmGroup> multicast_group_of(const std::string& url) {
    static const std::regex kUdpm(R"(udpm://([0-9.:]*)(?:\?(?:.*&)?ttl=([0-9]{1,3})(?:&.*)?|\?.*)?)");
    std::smatch match;
    if (!std::regex_match(url, match, kUdpm)) return std::nullopt;
    const std::string place = match[1].str();
    auto endpoint = driver::parse_endpoint(place.empty() ? "239.255.76.67" : place);
    if (!endpoint || !driver::is_multicast(endpoint->address)) return std::nullopt;
    if (endpoint->port == 0) endpoint->port = kDefaultPort;
    return LcmGroup{*endpoint, match[2].matched ? std::stoi(match[2].str()) : 0};
}

std::optional<driver::IpAddress> source_address_for(const LcmGroup& group) {
    return driver::source_address_for(driver::to_socket_address(group.endpoint, AF_INET));
}

bool has_route(const std::string& url) {
    const auto group = multicast_group_of(url_or_default(url));
    return !group || source_address_for(*group).has_value();
}

bool can_be_blocked(const std::string& url) {
    return url_or_default(url).starts_with(kTcpq);
}

bool has_usable_server(const std::string& url) {
    if (!url.starts_with(kTcpq)) return true;
    const std::string server = url.substr(kTcpq.size(), url.find('?') - kTcpq.size());
    if (server.empty()) return true;  // LCM's default, on this host
    const auto endpoint = driver::parse_endpoint(server);
    return endpoint && driver::is_ipv4(endpoint->address);
}

}  // namespace dlod::daemon
