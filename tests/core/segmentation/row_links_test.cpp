#include "core/segmentation/row_links.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace dlod {
namespace {

constexpr float kRatioRight = 1.05F;
constexpr float kRatioDown = 1.1F;
constexpr float kMaxStep_m = 0.4F;

bool linked(float a, float b, float ratio) {
    return std::min(a, b) > 0.0F && std::max(a, b) <= ratio * std::min(a, b) &&
           std::max(a, b) - std::min(a, b) <= kMaxStep_m;
}

bool bit(const std::vector<std::uint64_t>& words, int column) {
    const auto c = static_cast<std::size_t>(column);
    return (words[c / 64] >> (c % 64) & 1U) != 0;
}

/// Pieces of surface with noise, steps and holes.
std::vector<float> random_row(int width, std::mt19937& random) {
    std::vector<float> row(static_cast<std::size_t>(width));
    float range = 5.0F;
    for (float& value : row) {
        const unsigned dice = random() % 12;
        if (dice == 0) range = 2.0F + static_cast<float>(random() % 8);
        value = dice == 1 ? 0.0F : range + 0.05F * static_cast<float>(random() % 10);
    }
    return row;
}

/// Run of each column, -1 where there is none.
std::vector<int> runs_of(const std::vector<float>& row) {
    std::vector<int> run(row.size(), -1);
    int last = -1;
    for (std::size_t c = 0; c < row.size(); ++c) {
        if (row[c] == 0.0F) continue;
        run[c] = c > 0 && linked(row[c - 1], row[c], kRatioRight) ? last : ++last;
    }
    return run;
}

class RowLinksOfWidth : public testing::TestWithParam<int> {};

TEST_P(RowLinksOfWidth, EqualThoseOfPlainLoops) {
    const int width = GetParam();
    std::mt19937 random(3);
    RowLinks links(width);
    int wraps = 0;
    for (int image = 0; image < 3; ++image) {
        links.begin();
        std::vector<float> above(static_cast<std::size_t>(width), 0.0F);
        for (int r = 0; r < 40; ++r) {
            const std::vector<float> row = random_row(width, random);
            std::copy(row.begin(), row.end(), links.next_row());
            links.advance(kRatioRight, kRatioDown, kMaxStep_m);
            const std::vector<int> run = runs_of(row), run_above = runs_of(above);
            std::set<std::pair<int, int>> expected, found;
            for (int c = 0; c < width; ++c) {
                const auto i = static_cast<std::size_t>(c);
                const bool begins = run[i] >= 0 && (c == 0 || run[i - 1] != run[i]);
                const bool ends = run[i] >= 0 && (c + 1 == width || run[i + 1] != run[i]);
                ASSERT_EQ(bit(links.begins(), c), begins) << r << ' ' << c;
                ASSERT_EQ(bit(links.ends(), c), ends) << r << ' ' << c;
                ASSERT_EQ(bit(links.begins_above(), c),
                          run_above[i] >= 0 && (c == 0 || run_above[i - 1] != run_above[i]));
                const bool joined = linked(above[i], row[i], kRatioDown);
                if (joined) expected.emplace(run_above[i], run[i]);
                if (!bit(links.joins(), c)) continue;
                ASSERT_TRUE(joined) << r << ' ' << c;
                found.emplace(run_above[i], run[i]);
            }
            ASSERT_EQ(found, expected) << r;
            ASSERT_EQ(links.wraps(), linked(row.back(), row.front(), kRatioRight));
            wraps += links.wraps() ? 1 : 0;
            above = row;
        }
    }
    EXPECT_GT(wraps, 0);
}

INSTANTIATE_TEST_SUITE_P(Widths, RowLinksOfWidth, testing::Values(64, 100, 512, 1023));

}  // namespace
}  // namespace dlod
