#include "daemon/publish/lcm_bus.hpp"

#include <gtest/gtest.h>
#include <lcm/eventlog.h>

#include <algorithm>
#include <filesystem>
#include <latch>
#include <map>
#include <thread>
#include <vector>

#include "tests/support/tcpq_server.hpp"

namespace dlod::daemon {
namespace {

using namespace std::chrono_literals;
using test::TcpqServer;

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

std::vector<std::byte> bytes(std::size_t count, char value) {
    return std::vector<std::byte>(count, static_cast<std::byte>(value));
}

TEST(OpenLcm, AServerOfTcpqGetsAllInOrder) {
    TcpqServer server(TcpqServer::Manners::kReads);
    {
        const auto bus = open_lcm(server.url(), 10s);
        for (int i = 0; i < 300; ++i)
            EXPECT_TRUE(bus->publish("CHANNEL_" + std::to_string(i), bytes(1000, static_cast<char>(i))));
        EXPECT_EQ(bus->lost(), 0U);
    }
    while (server.messages().size() < 300) std::this_thread::sleep_for(10ms);
    const auto messages = server.messages();
    for (int i = 0; i < 300; ++i) {
        const auto& [channel, content] = messages[static_cast<std::size_t>(i)];
        EXPECT_EQ(channel, "CHANNEL_" + std::to_string(i));
        EXPECT_EQ(content, std::string(1000, static_cast<char>(i)));
    }
}

/// LCM itself waits for such a server without end, in publish() or when it is opened: were that not on a thread of its
/// own, this would not end.
TEST(OpenLcm, AServerOfTcpqThatStallsHoldsUpNobody) {
    for (const auto manners : {TcpqServer::Manners::kNeverReads, TcpqServer::Manners::kNeverAnswers}) {
        TcpqServer server(manners);
        const auto bus = open_lcm(server.url(), 0s);
        const auto message = bytes(60'000, 'x');
        while (bus->lost() < 100) EXPECT_TRUE(bus->publish("MASK", message));
    }
}

TEST(OpenLcm, AServerOfTcpqThatIsAwayHoldsUpNobody) {
    const std::string url = TcpqServer(TcpqServer::Manners::kReads).url();  // that has gone again
    const auto bus = open_lcm(url, 0s);
    while (bus->lost() < 100) EXPECT_TRUE(bus->publish("MASK", bytes(10, 'x')));
}

}  // namespace
}  // namespace dlod::daemon
