// The way out for messages; tests put something else behind it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace dlod::daemon {

/// Largest message, channel name included, that LCM sends as one datagram.
inline constexpr std::size_t kLargestDatagram = 65'499;

class MessageBus {
  public:
    virtual ~MessageBus() = default;
    /// Sends one encoded message. Never throws and does not wait for receivers. From any thread.
    /// @return false where it was not sent
    virtual bool publish(const std::string& channel, std::span<const std::byte> message) = 0;
    /// Messages for which publish() gave true and that could not be sent after all; from any thread.
    virtual std::uint64_t lost() const { return 0; }
};

}  // namespace dlod::daemon
