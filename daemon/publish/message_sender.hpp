#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "daemon/publish/message_bus.hpp"

namespace dlod::daemon {

/// Encodes LCM messages into a buffer made once. For one thread.
class MessageSender {
  public:
    explicit MessageSender(MessageBus& bus) : bus_(bus), buffer_(kLargestDatagram) {}

    template <class Message>
    void send(const std::string& channel, const Message& message) {
        const int size = message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
        if (size < 0 || !bus_.publish(channel, std::span(buffer_).first(static_cast<std::size_t>(size)))) {
            failed_.fetch_add(1, std::memory_order_relaxed);
        }
    }
    /// Messages that could not be sent; from any thread.
    std::uint64_t failed() const { return failed_.load(std::memory_order_relaxed); }

  private:
    MessageBus& bus_;
    std::vector<std::byte> buffer_;
    std::atomic<std::uint64_t> failed_{0};
};

}  // namespace dlod::daemon
