#include "daemon/publish/queued_bus.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

namespace dlod::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kMost = QueuedBus::kMostWaiting;

/// Where messages end up; takes none while it is blocked, or refuses them. Outlives the bus, as a server does.
class Server {
  public:
    bool take(const std::string& channel, std::span<const std::byte> message) {
        std::unique_lock lock(mutex_);
        ++begun_;
        changed_.notify_all();
        changed_.wait(lock, [&] { return !blocked_; });
        if (refuses_) return false;
        int number = 0;
        EXPECT_EQ(message.size(), sizeof number);
        std::memcpy(&number, message.data(), sizeof number);
        taken_.push_back(channel + " " + std::to_string(number));
        changed_.notify_all();
        return true;
    }
    void block(bool blocked) {
        const std::lock_guard lock(mutex_);
        blocked_ = blocked;
        changed_.notify_all();
    }
    void refuse(bool refuses) {
        const std::lock_guard lock(mutex_);
        refuses_ = refuses;
    }
    void wait_until_begun() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return begun_ > 0; });
    }
    std::vector<std::string> wait_for(std::size_t messages) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return taken_.size() >= messages; });
        return taken_;
    }
    std::vector<std::string> taken() const {
        const std::lock_guard lock(mutex_);
        return taken_;
    }

  private:
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool blocked_ = false;
    bool refuses_ = false;
    int begun_ = 0;
    std::vector<std::string> taken_;
};

class Connection final : public MessageBus {
  public:
    explicit Connection(std::shared_ptr<Server> server) : server_(std::move(server)) {}
    bool publish(const std::string& channel, std::span<const std::byte> message) override {
        return server_->take(channel, message);
    }

  private:
    std::shared_ptr<Server> server_;
};

class QueuedBusTest : public ::testing::Test {
  protected:
    std::function<std::unique_ptr<MessageBus>()> connect() {
        return [server = server_] { return std::make_unique<Connection>(server); };
    }
    static void publish(QueuedBus& bus, int number) {
        EXPECT_TRUE(bus.publish(channel(number), std::as_bytes(std::span(&number, 1))));
    }
    static std::string channel(int number) { return number % 2 == 0 ? "POSE" : "MASK"; }
    static std::string message(int number) { return channel(number) + " " + std::to_string(number); }

    std::shared_ptr<Server> server_ = std::make_shared<Server>();
};

TEST_F(QueuedBusTest, AllOfItArrivesInOrder) {
    QueuedBus bus(connect(), 0ms);
    std::vector<std::string> expected;
    for (int i = 0; i < 500; ++i) {
        publish(bus, i);
        expected.push_back(message(i));
        if (i % 50 == 0) server_->wait_for(expected.size());
    }
    EXPECT_EQ(server_->wait_for(expected.size()), expected);
    EXPECT_EQ(bus.lost(), 0U);
}

/// Were publish() to wait, this would not end.
TEST_F(QueuedBusTest, AServerThatReadsNothingHoldsUpNobodyAndTheNewestMessagesWin) {
    server_->block(true);
    QueuedBus bus(connect(), 0ms);
    publish(bus, 0);
    server_->wait_until_begun();
    constexpr int kMessages = 1000;
    for (int i = 1; i <= kMessages; ++i) publish(bus, i);
    EXPECT_EQ(bus.lost(), kMessages - kMost) << "bounded, and counted";
    server_->block(false);
    const auto taken = server_->wait_for(1 + kMost);
    EXPECT_EQ(taken.front(), message(0)) << "was on its way";
    for (std::size_t i = 0; i < kMost; ++i) {
        EXPECT_EQ(taken[1 + i], message(kMessages - static_cast<int>(kMost) + 1 + static_cast<int>(i)));
    }
    publish(bus, 5000);
    EXPECT_EQ(server_->wait_for(2 + kMost).back(), message(5000)) << "it goes on";
}

TEST_F(QueuedBusTest, WithPatienceNothingIsLostToAServerThatIsOnlySlow) {
    server_->block(true);
    QueuedBus bus(connect(), 1min);
    std::thread server([&] {
        server_->wait_until_begun();
        std::this_thread::sleep_for(50ms);  // the queue has long been full
        server_->block(false);
    });
    for (int i = 0; i < 500; ++i) publish(bus, i);
    server.join();
    EXPECT_EQ(server_->wait_for(500).back(), message(499));
    EXPECT_EQ(bus.lost(), 0U);
}

TEST_F(QueuedBusTest, PatienceEnds) {
    server_->block(true);
    QueuedBus bus(connect(), 100ms);
    publish(bus, 0);
    server_->wait_until_begun();
    for (int i = 1; i <= 1000; ++i) publish(bus, i);
    EXPECT_EQ(bus.lost(), 1000 - kMost);
    server_->block(false);
}

TEST_F(QueuedBusTest, WhatWaitsIsSentAtTheEnd) {
    {
        QueuedBus bus(connect(), 10s);
        for (int i = 0; i < 50; ++i) publish(bus, i);
    }
    EXPECT_EQ(server_->taken().size(), 50U);
}

TEST_F(QueuedBusTest, TheEndWaitsForNoServer) {
    server_->block(true);
    {
        QueuedBus bus(connect(), 0ms);
        for (int i = 0; i < 100; ++i) publish(bus, i);
        server_->wait_until_begun();
    }
    server_->block(false);
    server_->wait_for(1);  // of the thread that was left behind, which sends no more than that
}

TEST_F(QueuedBusTest, OpeningHoldsUpNobodyAndIsTriedAgain) {
    std::mutex mutex;
    mutex.lock();
    std::atomic<int> attempts{0};
    QueuedBus bus(
        [&]() -> std::unique_ptr<MessageBus> {
            const std::lock_guard lock(mutex);
            if (attempts++ == 0) return nullptr;
            return std::make_unique<Connection>(server_);
        },
        0ms);
    for (int i = 0; i < 10; ++i) publish(bus, i);
    mutex.unlock();
    const auto taken = server_->wait_for(9);
    EXPECT_EQ(taken.front(), message(1));
    EXPECT_EQ(bus.lost(), 1U) << "the message of the first attempt";
    EXPECT_EQ(attempts, 2);
}

TEST_F(QueuedBusTest, WhatCannotBeSentIsCounted) {
    server_->refuse(true);
    QueuedBus bus(connect(), 0ms);
    publish(bus, 0);
    server_->wait_until_begun();
    while (bus.lost() == 0) std::this_thread::sleep_for(1ms);
    server_->refuse(false);
    publish(bus, 1);
    EXPECT_EQ(server_->wait_for(1).front(), message(1));
    EXPECT_EQ(bus.lost(), 1U);
}

}  // namespace
}  // namespace dlod::daemon
