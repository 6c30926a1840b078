// What LCM's URLs mean, for who must know before LCM is opened.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "driver/network_address.hpp"

namespace dlod::daemon {

/// The URL that LCM takes an empty one for: $LCM_DEFAULT_URL, else its own default.
std::string url_or_default(const std::string& url);

/// True where the URL begins with one of LCM's providers.
bool has_lcm_provider(std::string_view url);

/// Where messages go by "udpm://ADDRESS:PORT?ttl=N". Parts that are not given are LCM's defaults.
struct LcmGroup {
    driver::Endpoint endpoint;
    int ttl = 0;  ///< 0: messages stay on this host
};
/// @return nothing where the URL is another provider's, or its address is no multicast address
std::optional<LcmGroup> multicast_group_of(const std::string& url);

/// The address of this host by which messages to the group leave; nothing, and errno, where no route leads there.
std::optional<driver::IpAddress> source_address_for(const LcmGroup& group);

/// False where the URL means a multicast group to which no route leads; errno tells why. LCM would print a page about
/// it at every attempt to open it.
bool has_route(const std::string& url);

/// True for the provider that sends to a server, which may be away or read nothing: tcpq. Opening it and sending then
/// waits without end.
bool can_be_blocked(const std::string& url);

/// False where the URL is one of tcpq whose server LCM would not find: it takes an IPv4 address, with a port or
/// without, and no name.
bool has_usable_server(const std::string& url);

}  // namespace dlod::daemon
