#include "core/evidence/occlusion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace dlod {
namespace {

constexpr int kHeight = 12;
constexpr double kStep_m = 0.3;

struct Ends {
    bool left = false, right = false;
};

/// Pixel by pixel, as the header tells it.
Ends slowly(const std::vector<PixelIndex>& pixels, const Image<float>& range_m) {
    const int width = range_m.width();
    const int reference = static_cast<int>(pixels.front()) % width;
    const auto relative = [&](PixelIndex pixel) {
        const int column = (static_cast<int>(pixel) % width - reference + width) % width;
        return column > (width - 1) / 2 ? column - width : column;
    };
    const auto range_at = [&](int row, int column) { return range_m(row, (column + reference + width) % width); };
    int rows = 0, hidden_left = 0, hidden_right = 0;
    for (int r = 0; r < kHeight; ++r) {
        int left = width, right = -width;
        for (const PixelIndex pixel : pixels) {
            if (static_cast<int>(pixel) / width != r) continue;
            left = std::min(left, relative(pixel));
            right = std::max(right, relative(pixel));
        }
        if (left > right) continue;
        ++rows;
        const auto nearer = [&](int end, int direction) {
            for (int i = 1; i <= 3; ++i) {
                const float beyond = range_at(r, end + direction * i);
                if (beyond > 0.0F) return beyond < range_at(r, end) - static_cast<float>(kStep_m);
            }
            return false;
        };
        hidden_left += nearer(left, -1) ? 1 : 0;
        hidden_right += nearer(right, 1) ? 1 : 0;
    }
    return {2 * hidden_left >= rows, 2 * hidden_right >= rows};
}

class OcclusionOfWidth : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Widths, OcclusionOfWidth, ::testing::Values(64, 63));

TEST_P(OcclusionOfWidth, IsThatOfEveryPixelByItself) {
    const int width = GetParam();
    std::mt19937 random(7);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    std::vector<int> row_ends(2 * kHeight);
    int left = 0, right = 0;
    constexpr int kTrials = 400;
    for (int trial = 0; trial < kTrials; ++trial) {
        Image<float> range_m(kHeight, width);
        std::vector<PixelIndex> pixels;
        // Runs of pixels, some across the image's seam, before a background of other distances.
        const int middle = below(width), breadth = 1 + below(trial % 4 == 0 ? width - 1 : 20);
        const bool nearer_left = below(2) == 0, nearer_right = below(2) == 0;
        for (int r = 0; r < kHeight; ++r) {
            for (int c = 0; c < width; ++c) {
                const bool on_left = (c - middle + width) % width > width / 2;
                range_m(r, c) = below(6) == 0 ? 0.0F : (on_left ? nearer_left : nearer_right) ? 3.0F : 7.0F;
            }
            if (below(4) == 0) continue;
            for (int k = 0; k < breadth; ++k) {
                const int c = (middle - breadth / 2 + k + width) % width;
                range_m(r, c) = 5.0F;
                if (below(12) != 0) pixels.push_back(static_cast<PixelIndex>(r * width + c));
            }
        }
        if (pixels.empty()) continue;
        if (trial % 2 == 0) std::sort(pixels.begin(), pixels.end());
        Detection detection;
        mark_occlusion(pixels, range_m, kStep_m, row_ends, detection);
        const Ends ends = slowly(pixels, range_m);
        ASSERT_EQ(detection.occluded_left, ends.left) << trial;
        ASSERT_EQ(detection.occluded_right, ends.right) << trial;
        left += ends.left ? 1 : 0;
        right += ends.right ? 1 : 0;
    }
    for (const int n : {left, right}) {
        EXPECT_GT(n, kTrials / 10);
        EXPECT_LT(n, kTrials * 9 / 10);
    }
}

}  // namespace
}  // namespace dlod
