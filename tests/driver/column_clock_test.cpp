#include "driver/column_clock.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace dlod::driver {
namespace {

constexpr int kColumns = 512;
constexpr double kTurn_ns = 1e8;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

Columns columns_at(double turn_ns) {
    Columns columns;
    for (int m = 0; m < kColumns; ++m) {
        columns.time_ns.push_back(kStart_ns + static_cast<std::int64_t>(turn_ns * m / kColumns));
        columns.status.push_back(1);
        columns.valid.push_back(1);
    }
    return columns;
}

int valid_count(const Columns& columns) {
    int n = 0;
    for (const std::uint8_t v : columns.valid) n += v;
    return n;
}

TEST(ColumnClock, BelievesASteadyTurn) {
    ColumnClock clock(kColumns, kTurn_ns, 0.05);
    Columns columns = columns_at(kTurn_ns * 1.002);
    EXPECT_EQ(clock.reject(columns), 0);
    EXPECT_NEAR(clock.start_ns(), static_cast<double>(kStart_ns), 0.05 * kTurn_ns);
}

TEST(ColumnClock, BelievesASensorThatTurnsAtAnotherRate) {
    ColumnClock clock(kColumns, kTurn_ns, 0.05);
    for (const double turn_ns : {kTurn_ns / 2, kTurn_ns * 2}) {
        Columns columns = columns_at(turn_ns);
        EXPECT_EQ(clock.reject(columns), 0);
        EXPECT_EQ(valid_count(columns), kColumns);
    }
}

TEST(ColumnClock, AMinorityOnAnotherClockIsRejected) {
    ColumnClock clock(kColumns, kTurn_ns, 0.05);
    Columns columns = columns_at(kTurn_ns);
    for (std::size_t m = 0; m < 200; ++m) columns.time_ns[m] -= 37'000'000'000;
    EXPECT_EQ(clock.reject(columns), 200);
    EXPECT_EQ(columns.valid[0], 0);
    EXPECT_EQ(columns.time_ns[0], 0);
    EXPECT_EQ(columns.valid[200], 1);
}

TEST(ColumnClock, IsolatedColumnsAreJudgedByTheirNeighbours) {
    for (const std::size_t m : {std::size_t{0}, std::size_t{1}, std::size_t{250}, std::size_t{510}, std::size_t{511}}) {
        for (const std::int64_t off_ns : {std::int64_t{-3'000'000}, std::int64_t{3'000'000}}) {
            ColumnClock clock(kColumns, kTurn_ns, 0.05);
            Columns columns = columns_at(kTurn_ns);
            columns.time_ns[m] += off_ns;
            EXPECT_EQ(clock.reject(columns), 1) << m;
            EXPECT_EQ(columns.valid[m], 0) << m;
        }
    }
}

TEST(ColumnClock, SmallJitterIsNoFault) {
    ColumnClock clock(kColumns, kTurn_ns, 0.05);
    Columns columns = columns_at(kTurn_ns);
    for (std::size_t m = 0; m < kColumns; ++m) columns.time_ns[m] += m % 2 == 0 ? 50'000 : -50'000;
    EXPECT_EQ(clock.reject(columns), 0);
}

TEST(ColumnClock, TimesOfInvalidColumnsAreCheckedButNotCounted) {
    ColumnClock clock(kColumns, kTurn_ns, 0.05);
    Columns columns = columns_at(kTurn_ns);
    columns.valid[3] = 0;
    columns.valid[4] = 0;
    columns.time_ns[4] = ColumnClock::to_time(~std::uint64_t{0});
    const std::int64_t kept = columns.time_ns[3];
    EXPECT_EQ(clock.reject(columns), 0);
    EXPECT_EQ(columns.time_ns[3], kept);
    EXPECT_EQ(columns.time_ns[4], 0);
}

TEST(ColumnClock, NothingValidLeavesNothingToJudge) {
    ColumnClock clock(kColumns, kTurn_ns, 0.05);
    Columns columns = columns_at(kTurn_ns);
    std::fill(columns.valid.begin(), columns.valid.end(), std::uint8_t{0});
    columns.time_ns[9] = -1;
    EXPECT_EQ(clock.reject(columns), 0);
    EXPECT_EQ(columns.time_ns[9], 0);
    Columns one = columns_at(kTurn_ns);
    std::fill(one.valid.begin(), one.valid.end(), std::uint8_t{0});
    one.valid[100] = 1;
    EXPECT_EQ(clock.reject(one), 0);
    EXPECT_EQ(one.valid[100], 1);
}

}  // namespace
}  // namespace dlod::driver
