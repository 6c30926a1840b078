#include "driver/paced_source.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace dlod::driver {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(ReplayClock, KeepsDistancesAtItsRate) {
    ReplayClock clock(2.0);
    EXPECT_EQ(clock.wait_ns(500 * kSecond, 10 * kSecond), 0);
    EXPECT_EQ(clock.wait_ns(501 * kSecond, 10 * kSecond), kSecond / 2);
    // A delay does not add up: the next packet is due at its distance from the first.
    EXPECT_EQ(clock.wait_ns(502 * kSecond, 10 * kSecond + 900'000'000), 100'000'000);
    EXPECT_EQ(clock.wait_ns(503 * kSecond, 12 * kSecond), 0);
}

TEST(ReplayClock, NoRateNoWait) {
    for (const double rate : {0.0, -1.0}) {
        ReplayClock clock(rate);
        EXPECT_EQ(clock.wait_ns(0, 0), 0);
        EXPECT_EQ(clock.wait_ns(100 * kSecond, 0), 0);
    }
}

TEST(ReplayClock, StartsAnewWhereTimeJumps) {
    ReplayClock clock(1.0);
    clock.wait_ns(100 * kSecond, 0);
    EXPECT_EQ(clock.wait_ns(188 * kSecond, kSecond), 0);  // a pause in the recording
    EXPECT_EQ(clock.wait_ns(189 * kSecond, kSecond), kSecond);
    EXPECT_EQ(clock.wait_ns(50 * kSecond, 2 * kSecond), 0);  // a clock set back
    EXPECT_EQ(clock.wait_ns(51 * kSecond, 2 * kSecond), kSecond);
    EXPECT_EQ(clock.wait_ns(51 * kSecond - 1000, 2 * kSecond), kSecond - 1000);  // only out of order
}

TEST(ReplayClock, OddTimesStayInRange) {
    ReplayClock clock(1e-300, std::int64_t{1} << 62);
    clock.wait_ns(0, 0);
    EXPECT_GT(clock.wait_ns(std::int64_t{1} << 61, 0), 0);
}

/// Packets of one byte at given times.
class ListedPackets final : public PacketSource {
  public:
    explicit ListedPackets(std::vector<std::int64_t> times_ns) : times_ns_(std::move(times_ns)) { warn("listed"); }
    PacketBatch next() override {
        if (stopped_) return {.status = SourceStatus::kStopped, .packets = {}};
        if (next_ == times_ns_.size()) return {.status = SourceStatus::kEnd, .packets = {}};
        packet_.receive_ns = times_ns_[next_++];
        return {.status = SourceStatus::kPackets, .packets = std::span(&packet_, 1)};
    }
    void stop() noexcept override { stopped_ = true; }
    void visit_counters(const CounterVisitor& visit) const override { visit("next", next_); }

  private:
    std::vector<std::int64_t> times_ns_;
    std::size_t next_ = 0;
    std::atomic<bool> stopped_{false};
    Packet packet_;
};

TEST(PacedSource, DeliversAtTheRate) {
    PacedSource source(std::make_unique<ListedPackets>(std::vector<std::int64_t>{0, 100'000'000, 200'000'000}), 2.0);
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 3; ++i) {
        const PacketBatch batch = source.next();
        ASSERT_EQ(batch.status, SourceStatus::kPackets);
        EXPECT_EQ(batch.packets[0].receive_ns, i * 100'000'000);
    }
    EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(100));
    EXPECT_EQ(source.next().status, SourceStatus::kEnd);
    EXPECT_EQ(source.take_warnings(), std::vector<std::string>{"listed"});
    source.visit_counters([](std::string_view, std::uint64_t n) { EXPECT_EQ(n, 3U); });
}

TEST(PacedSource, StopEndsTheSleep) {
    PacedSource source(std::make_unique<ListedPackets>(std::vector<std::int64_t>{0, 9 * kSecond}), 0.01);
    EXPECT_EQ(source.next().status, SourceStatus::kPackets);
    std::thread stopper([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        source.stop();
    });
    EXPECT_EQ(source.next().status, SourceStatus::kStopped);
    EXPECT_EQ(source.next().status, SourceStatus::kStopped);
    stopper.join();
}

}  // namespace
}  // namespace dlod::driver
