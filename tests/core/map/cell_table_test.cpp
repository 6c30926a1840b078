#include "core/map/cell_table.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <tuple>

namespace dlod {
namespace {

TEST(CellTable, BehavesAsAMapDoes) {
    CellTable table(0.5);
    std::map<std::tuple<int, int, int>, MapPoint> slow;
    std::mt19937 random(11);
    std::uniform_real_distribution<float> u(-20.0F, 20.0F);
    for (int i = 0; i < 200000; ++i) {
        const MapPoint p{u(random), u(random), 0.1F * u(random)};
        const CellTable::Index c = table.index_of(p.x, p.y, p.z);
        if (i % 3 == 2) {
            EXPECT_EQ(table.erase(c), slow.erase({c.x, c.y, c.z}) == 1);
        } else {
            table.insert(p);
            slow.insert({{c.x, c.y, c.z}, p});
        }
    }
    ASSERT_EQ(table.size(), slow.size());
    const std::vector<MapPoint> points = table.sorted();
    ASSERT_EQ(points.size(), slow.size());
    std::size_t i = 0;
    for (const auto& [cell, p] : slow) {
        EXPECT_EQ(points[i].x, p.x);
        EXPECT_EQ(points[i].z, p.z);
        const MapPoint* found = table.find({std::get<0>(cell), std::get<1>(cell), std::get<2>(cell)});
        ASSERT_NE(found, nullptr);
        EXPECT_EQ(found->y, p.y);
        ++i;
    }
}

TEST(CellTable, RetainsWhatItIsToldTo) {
    CellTable table(0.2);
    for (int i = -500; i < 500; ++i) table.insert({0.2F * static_cast<float>(i) + 0.1F, 0.0F, 0.0F});
    table.retain([](const MapPoint& p) { return p.x > 0.0F; });
    EXPECT_EQ(table.size(), 500U);
    for (const MapPoint& p : table.sorted()) EXPECT_GT(p.x, 0.0F);
}

TEST(CellTable, TellsWhatStayedFromWhatPassed) {
    CellTable table(0.2, {.confirm_ds = 15, .gap_ds = 30});
    const MapPoint stays{0.1F, 0.1F, 0.1F}, passes{1.1F, 0.1F, 0.1F}, comes_again{2.1F, 0.1F, 0.1F};
    for (int t = 0; t < 100; ++t) {
        // Times near the wrap of the clock.
        const auto now = static_cast<std::uint16_t>(0x7FF0 + t);
        table.insert(stays, now);
        if (t < 10) table.insert(passes, now);
        if (t % 40 < 8) table.insert(comes_again, now);
    }
    const auto confirmed = table.sorted([](const Persistence& seen) { return seen.confirmed(); });
    ASSERT_EQ(confirmed.size(), 1U);
    EXPECT_EQ(confirmed[0].x, stays.x);
    EXPECT_EQ(table.size(), 3U);
}

}  // namespace
}  // namespace dlod
