#include "core/removal/box_history.hpp"

#include <gtest/gtest.h>

namespace dlod {
namespace {

OrientedBox at(double x) {
    OrientedBox b;
    b.center_m.x() = x;
    b.size_m = {0.5, 0.5, 1.7};
    return b;
}

TEST(BoxHistory, KeepsTheLastBoxesOldestFirst) {
    BoxHistory history;
    const int n = static_cast<int>(BoxHistory::kCapacity) + 10;
    for (int i = 0; i < n; ++i) history.add(at(i));
    std::vector<OrientedBox> out = {at(-5)};
    history.release(out);
    ASSERT_EQ(out.size(), BoxHistory::kCapacity + 1);
    EXPECT_EQ(out[0].center_m.x(), -5.0);
    for (std::size_t i = 1; i < out.size(); ++i) EXPECT_EQ(out[i].center_m.x(), static_cast<double>(i) + 9.0);
    EXPECT_EQ(history.size(), 0U);
}

TEST(BoxHistory, ARestDoesNotPushOutTheWalkBeforeIt) {
    BoxHistory history;
    for (int i = 0; i < 5; ++i) history.add(at(i));
    for (int i = 0; i < 10000; ++i) history.add(at(4.0 + 0.01 * (i % 3)));
    EXPECT_EQ(history.size(), 5U);
}

}  // namespace
}  // namespace dlod
