#include "daemon/pipeline/admission.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace dlod::daemon {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPeriod = 100 * kMs;

TEST(Admission, WithoutABoundEveryFrameIsBegun) {
    Admission admission(0);
    const auto mark = admission.taken(0);
    EXPECT_TRUE(admission.open());
    EXPECT_FALSE(admission.too_late(3600'000 * kMs));
    admission.published(mark, 1000 * kMs);
    EXPECT_TRUE(admission.open());
}

TEST(Admission, FramesAreBegunSideBySideWhileThatKeepsTheBound) {
    Admission admission(2 * kPeriod);
    for (int i = 0; i < 20; ++i) {  // each takes 130 ms, another one begins after 100
        EXPECT_TRUE(admission.open());
        const auto first = admission.taken(i * kPeriod);
        EXPECT_TRUE(admission.open()) << "beside the one at work";
        EXPECT_FALSE(admission.too_late(50 * kMs));
        admission.published(first, i * kPeriod + 130 * kMs);
    }
    const auto first = admission.taken(0);
    const auto second = admission.taken(10 * kMs);
    admission.published(first, 150 * kMs);
    admission.published(second, 320 * kMs);  // they hold each other up
    admission.taken(330 * kMs);
    EXPECT_FALSE(admission.open()) << "one at a time from now on";
}

/// One thread that takes `cost_ns` a frame; frames come every period, the newest wins. Latencies of what it published.
std::vector<std::int64_t> published_latencies(std::int64_t cost_ns, int frames) {
    Admission admission(2 * kPeriod);
    std::vector<std::int64_t> latencies;
    std::int64_t free_ns = 0;  // when the thread has nothing to do
    for (int i = 0; i < frames; ++i) {
        const std::int64_t came_ns = i * kPeriod;
        const std::int64_t next_ns = came_ns + kPeriod;
        const std::int64_t now_ns = std::max(came_ns, free_ns);
        if (now_ns >= next_ns || admission.too_late(now_ns - came_ns)) continue;  // a newer one waits
        const auto mark = admission.taken(now_ns);
        free_ns = now_ns + cost_ns;
        admission.published(mark, free_ns);
        latencies.push_back(free_ns - came_ns);
    }
    return latencies;
}

TEST(Admission, LatencyStaysWithinTheBoundWhateverAFrameCosts) {
    for (const std::int64_t cost_ms : {20, 90, 110, 130, 150, 175}) {
        const auto latencies = published_latencies(cost_ms * kMs, 300);
        EXPECT_GE(latencies.size(), 140U) << cost_ms;
        std::size_t late = 0;
        for (const auto latency : latencies) late += latency > 2 * kPeriod ? 1 : 0;
        EXPECT_LE(late, 3U) << "only until it has learnt what a frame costs: " << cost_ms;
        EXPECT_LE(latencies.back(), 2 * kPeriod) << cost_ms;
    }
}

TEST(Admission, FramesThatCostTooMuchAreBegunOnlyFresh) {
    const auto latencies = published_latencies(350 * kMs, 300);
    EXPECT_GE(latencies.size(), 70U) << "a quarter of them: poses still come";
    EXPECT_LE(latencies.back(), 375 * kMs);
}

}  // namespace
}  // namespace dlod::daemon
