#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>

#include "daemon/publish/message_bus.hpp"

struct _lcm_t;

namespace dlod::daemon {

/// LCM cannot be used as configured; the message says what to do.
class MessageBusError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// @throws MessageBusError where the URL means a multicast group to which no route leads
void require_route(const std::string& url);

/// LCM, for publishing only: its receiving side tests itself for up to ten seconds where multicast does not work, and
/// is made only for who subscribes.
class LcmBus final : public MessageBus {
  public:
    /// @param url LCM provider, "udpm://239.255.76.67:7667?ttl=1"; empty: LCM's default
    /// @throws MessageBusError at once where the URL is wrong or no route leads to its group
    explicit LcmBus(const std::string& url);
    ~LcmBus() override;
    LcmBus(const LcmBus&) = delete;
    LcmBus& operator=(const LcmBus&) = delete;

    bool publish(const std::string& channel, std::span<const std::byte> message) override;

  private:
    _lcm_t* lcm_ = nullptr;
    std::mutex sending_;  ///< of LCM's providers only multicast takes care that messages of several threads do not mix
};

/// LCM by any provider. One that a server can block (tcpq) is opened and written to on a thread of its own.
/// @param patience of a QueuedBus
/// @throws MessageBusError as LcmBus does
std::unique_ptr<MessageBus> open_lcm(const std::string& url, std::chrono::milliseconds patience);

}  // namespace dlod::daemon
