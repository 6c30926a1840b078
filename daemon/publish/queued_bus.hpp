// A way out that can be blocked, as LCM's tcpq is by a server that reads nothing, and nobody who waits for it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

#include "daemon/publish/message_bus.hpp"

namespace dlod::daemon {

/// Sends in order on a thread of its own, which opens the bus behind it, too. Where more wait than may, the newest win:
/// the oldest is lost and counted.
class QueuedBus final : public MessageBus {
  public:
    /// Messages that may wait: those of a second or two, four megabytes at most.
    static constexpr std::size_t kMostWaiting = 64;

    /// @param open makes the bus behind, or nothing where it cannot now: it is tried again with a later message
    /// @param patience how long publish() waits for room since a message has last got out, before one is lost: none
    ///     live; what is replayed can wait, but not for ever
    QueuedBus(std::function<std::unique_ptr<MessageBus>()> open, std::chrono::milliseconds patience);
    /// What waits is still sent, if that takes no longer than a fifth of a second, or than the patience.
    ~QueuedBus() override;
    QueuedBus(const QueuedBus&) = delete;
    QueuedBus& operator=(const QueuedBus&) = delete;

    /// @return true: what becomes of it later is counted in lost()
    bool publish(const std::string& channel, std::span<const std::byte> message) override;
    std::uint64_t lost() const override;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with the thread, which is left behind where it is blocked
    std::thread thread_;
};

}  // namespace dlod::daemon
