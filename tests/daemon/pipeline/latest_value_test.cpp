#include "daemon/pipeline/latest_value.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace dlod::daemon {
namespace {

TEST(LatestValue, TheNewestIsTakenOnce) {
    LatestValue<int> value;
    EXPECT_EQ(value.take(), nullptr);
    value.set(1);
    value.set(2);
    const int* taken = value.take();
    ASSERT_NE(taken, nullptr);
    EXPECT_EQ(*taken, 2);
    EXPECT_EQ(value.take(), nullptr);
    EXPECT_EQ(*taken, 2) << "stays";
    value.set(3);
    value.set(4);
    value.set(5);
    EXPECT_EQ(*taken, 2) << "until the next call";
    EXPECT_EQ(*value.take(), 5);
}

TEST(LatestValue, ValuesComeWholeAndInOrder) {
    using Value = std::array<int, 64>;
    constexpr int kLast = 100'000;
    LatestValue<Value> value;
    std::thread writer([&] {
        Value v;
        for (int i = 1; i <= kLast; ++i) {
            v.fill(i);
            value.set(v);
        }
    });
    int last = 0;
    while (last < kLast) {
        const Value* v = value.take();
        if (v == nullptr) {
            std::this_thread::yield();
            continue;
        }
        EXPECT_GT(v->front(), last);
        for (const int part : *v) EXPECT_EQ(part, v->front());
        last = v->front();
    }
    writer.join();
}

}  // namespace
}  // namespace dlod::daemon
