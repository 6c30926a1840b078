#include "daemon/publish/lcm_bus.hpp"

#include <gtest/gtest.h>
#include <lcm/eventlog.h>

#include <algorithm>
#include <filesystem>
#include <latch>
#include <map>
#include <thread>
#include <vector>

namespace dlod::daemon {
namespace {

/// Poses, masks and status come from several threads; LCM itself lets those of a log file run into each other.
TEST(LcmBus, MessagesOfSeveralThreadsStayWhole) {
    const auto file = std::filesystem::path(::testing::TempDir()) / "lcm_bus_test.log";
    std::filesystem::remove(file);
    constexpr int kMessages = 10'000;
    constexpr int kBytes = 100;
    const std::vector<std::string> channels = {"POSE", "MASK", "TRACKS"};
    {
        std::latch all_ready(static_cast<std::ptrdiff_t>(channels.size()));
        LcmBus bus("file://" + file.string() + "?mode=w");
        std::vector<std::thread> threads;
        for (const auto& channel : channels) {
            threads.emplace_back([&] {
                const std::vector<std::byte> message(kBytes, static_cast<std::byte>(channel[0]));
                all_ready.arrive_and_wait();
                for (int i = 0; i < kMessages; ++i) EXPECT_TRUE(bus.publish(channel, message));
            });
        }
        for (auto& thread : threads) thread.join();
    }
    lcm_eventlog_t* log = ::lcm_eventlog_create(file.c_str(), "r");
    ASSERT_NE(log, nullptr);
    std::map<std::string, int> seen;
    while (lcm_eventlog_event_t* event = ::lcm_eventlog_read_next_event(log)) {
        const std::string channel(event->channel, static_cast<std::size_t>(event->channellen));
        const auto* data = static_cast<const char*>(event->data);
        EXPECT_EQ(event->datalen, kBytes);
        EXPECT_TRUE(std::all_of(data, data + event->datalen, [&](char c) { return c == channel[0]; })) << channel;
        ++seen[channel];
        ::lcm_eventlog_free_event(event);
    }
    ::lcm_eventlog_destroy(log);
    std::filesystem::remove(file);
    for (const auto& channel : channels) EXPECT_EQ(seen[channel], kMessages) << channel;
}

}  // namespace
}  // namespace dlod::daemon
