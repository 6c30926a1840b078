// Keeps what is published.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "daemon/publish/message_bus.hpp"

namespace dlod::test {

class RecordingBus final : public daemon::MessageBus {
  public:
    bool publish(const std::string& channel, std::span<const std::byte> message) override {
        EXPECT_LE(channel.size() + 1 + message.size(), daemon::kLargestDatagram) << channel;
        messages[channel].emplace_back(message.begin(), message.end());
        return accepts;
    }
    template <class Message>
    std::vector<Message> decoded(const std::string& channel) {
        std::vector<Message> result;
        for (const auto& bytes : messages[channel]) {
            Message message;
            EXPECT_GT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
            result.push_back(message);
        }
        return result;
    }
    std::map<std::string, std::vector<std::vector<std::byte>>> messages;
    bool accepts = true;
};

}  // namespace dlod::test
