#include "core/tracking/hungarian.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace dlod {
namespace {

/// Least sum over all ways to give each of the fewer ones one of the more.
double brute_force(const std::vector<double>& cost, int rows, int columns) {
    const bool tall = rows > columns;
    std::vector<int> order(static_cast<std::size_t>(std::max(rows, columns)));
    std::iota(order.begin(), order.end(), 0);
    double best = 1e300;
    do {
        double sum = 0.0;
        for (int i = 0; i < std::min(rows, columns); ++i) {
            const int r = tall ? order[static_cast<std::size_t>(i)] : i;
            const int c = tall ? i : order[static_cast<std::size_t>(i)];
            sum += cost[static_cast<std::size_t>(r * columns + c)];
        }
        best = std::min(best, sum);
    } while (std::next_permutation(order.begin(), order.end()));
    return best;
}

double sum_of(const std::vector<int>& column_of, const std::vector<double>& cost, int columns) {
    double sum = 0.0;
    for (std::size_t r = 0; r < column_of.size(); ++r) {
        if (column_of[r] >= 0)
            sum += cost[r * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column_of[r])];
    }
    return sum;
}

TEST(Hungarian, IsAsGoodAsBruteForce) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    std::uniform_int_distribution<int> size(1, 6), small(0, 2);
    Hungarian hungarian;
    for (int trial = 0; trial < 300; ++trial) {
        const int rows = size(random), columns = size(random);
        std::vector<double> cost(static_cast<std::size_t>(rows * columns));
        for (double& c : cost) c = trial % 2 == 0 ? u(random) : small(random);  // and with ties
        const std::vector<int> column_of = hungarian.solve(cost, rows, columns);
        ASSERT_EQ(column_of.size(), static_cast<std::size_t>(rows));
        std::vector<int> used;
        for (int c : column_of) {
            if (c >= 0) used.push_back(c);
        }
        EXPECT_EQ(used.size(), static_cast<std::size_t>(std::min(rows, columns)));
        std::sort(used.begin(), used.end());
        EXPECT_TRUE(std::adjacent_find(used.begin(), used.end()) == used.end());
        EXPECT_NEAR(sum_of(column_of, cost, columns), brute_force(cost, rows, columns), 1e-9);
    }
}

TEST(Hungarian, IsDeterministicAndTakesLargeProblems) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    std::vector<double> cost(120 * 200);
    for (double& c : cost) c = u(random);
    Hungarian a, b;
    const std::vector<int> first = a.solve(cost, 120, 200);
    EXPECT_EQ(first, a.solve(cost, 120, 200));
    EXPECT_EQ(first, b.solve(cost, 120, 200));
    // No exchange of two pairs betters an optimum.
    for (std::size_t i = 0; i < 120; ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const auto ci = static_cast<std::size_t>(first[i]), cj = static_cast<std::size_t>(first[j]);
            EXPECT_LE(cost[i * 200 + ci] + cost[j * 200 + cj], cost[i * 200 + cj] + cost[j * 200 + ci] + 1e-12);
        }
    }
}

TEST(Hungarian, EmptyProblems) {
    Hungarian hungarian;
    EXPECT_TRUE(hungarian.solve({}, 0, 4).empty());
    EXPECT_EQ(hungarian.solve({}, 3, 0), std::vector<int>(3, -1));
}

}  // namespace
}  // namespace dlod
