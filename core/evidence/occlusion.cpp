#include "core/evidence/occlusion.hpp"

#include <algorithm>

namespace dlod {

void mark_occlusion(std::span<const PixelIndex> pixels, const Image<float>& range_m, double min_step_m,
                    std::span<int> row_ends, Detection& detection) {
    detection.occluded_left = false;
    detection.occluded_right = false;
    if (pixels.empty()) return;
    const int width = range_m.width();
    const int height = range_m.height();
    // Columns relative to the first pixel, so that the image's seam does not matter.
    const int reference = static_cast<int>(pixels.front()) % width;
    std::span<int> left = row_ends.first(static_cast<std::size_t>(height));
    std::span<int> right = row_ends.subspan(static_cast<std::size_t>(height), static_cast<std::size_t>(height));
    std::fill(left.begin(), left.end(), width);
    std::fill(right.begin(), right.end(), -width);
    for (const PixelIndex p : pixels) {
        const auto row = static_cast<std::size_t>(static_cast<int>(p) / width);
        int column = static_cast<int>(p) % width - reference;
        if (column >= width / 2) column -= width;
        if (column < -width / 2) column += width;
        left[row] = std::min(left[row], column);
        right[row] = std::max(right[row], column);
    }
    constexpr int kReach = 3;  // columns beyond the end in which the neighbour's return is looked for
    const auto step = static_cast<float>(min_step_m);
    const auto wrapped = [&](int column) { return ((column + reference) % width + width) % width; };
    const auto nearer_beyond = [&](int row, int end, int direction) {
        const float own = range_m(row, wrapped(end));
        for (int i = 1; i <= kReach; ++i) {
            const float beyond = range_m(row, wrapped(end + direction * i));
            if (beyond > 0.0F) return beyond < own - step;
        }
        return false;
    };
    int rows = 0;
    int hidden_left = 0;
    int hidden_right = 0;
    for (int r = 0; r < height; ++r) {
        const auto row = static_cast<std::size_t>(r);
        if (right[row] < left[row]) continue;
        ++rows;
        hidden_left += nearer_beyond(r, left[row], -1) ? 1 : 0;
        hidden_right += nearer_beyond(r, right[row], 1) ? 1 : 0;
    }
    detection.occluded_left = 2 * hidden_left >= rows;
    detection.occluded_right = 2 * hidden_right >= rows;
}

}  // namespace dlod
