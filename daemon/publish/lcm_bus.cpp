#include "daemon/publish/lcm_bus.hpp"

#include <fmt/format.h>
#include <lcm/lcm.h>

#include <cerrno>
#include <cstring>

#include "daemon/publish/lcm_url.hpp"
#include "daemon/publish/queued_bus.hpp"

namespace dlod::daemon {

void require_route(const std::string& url) {
    if (has_route(url)) return;
    throw MessageBusError(
        fmt::format("lcm.url '{}': LCM cannot be opened: no route for multicast: {}. Without a network: ip link set lo "
                    "multicast on; ip route add 224.0.0.0/4 dev lo. To publish nothing: lcm.url none",
                    url, std::strerror(errno)));
}

LcmBus::LcmBus(const std::string& url) {
    require_route(url);
    lcm_ = ::lcm_create(url.empty() ? nullptr : url.c_str());
    if (lcm_ == nullptr) {
        throw MessageBusError(
            fmt::format("lcm.url '{}': LCM cannot be opened: is the URL right? To publish nothing: lcm.url none", url));
    }
}

LcmBus::~LcmBus() {
    ::lcm_destroy(lcm_);
}

bool LcmBus::publish(const std::string& channel, std::span<const std::byte> message) {
    const std::lock_guard lock(sending_);
    return ::lcm_publish(lcm_, channel.c_str(), message.data(), static_cast<unsigned>(message.size())) == 0;
}

std::unique_ptr<MessageBus> open_lcm(const std::string& url, std::chrono::milliseconds patience) {
    if (!can_be_blocked(url)) return std::make_unique<LcmBus>(url);
    const auto open = [url]() -> std::unique_ptr<MessageBus> {
        try {
            return std::make_unique<LcmBus>(url);
        } catch (const MessageBusError&) {
            return nullptr;
        }
    };
    return std::make_unique<QueuedBus>(open, patience);
}

}  // namespace dlod::daemon
