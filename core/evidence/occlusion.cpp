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
    const auto [first, last] = std::minmax_element(pixels.begin(), pixels.end());
    const int top = static_cast<int>(*first) / width;
    const int bottom = static_cast<int>(*last) / width;
    std::fill(left.begin() + top, left.begin() + bottom + 1, width);
    std::fill(right.begin() + top, right.begin() + bottom + 1, -width);
    std::size_t at = 0;  // the row at hand
    int row_begin = -width;
    for (const PixelIndex pixel : pixels) {
        const auto p = static_cast<int>(pixel);
        // Pixels of a row mostly follow each other.
        if (p < row_begin || p >= row_begin + width) {
            at = static_cast<std::size_t>(p / width);
            row_begin = p / width * width;
        }
        int column = p - row_begin - reference;
        if (column >= width / 2) column -= width;
        if (column < -width / 2) column += width;
        left[at] = std::min(left[at], column);
        right[at] = std::max(right[at], column);
    }
    constexpr int kReach = 3;  // columns beyond the end in which the neighbour's return is looked for
    const auto step = static_cast<float>(min_step_m);
    const auto wrapped = [&](int column) {
        const int c = column + reference;
        return c < 0 ? c + width : c >= width ? c - width : c;
    };
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
    for (int r = top; r <= bottom; ++r) {
        const int leftmost = left[static_cast<std::size_t>(r)];
        const int rightmost = right[static_cast<std::size_t>(r)];
        if (rightmost < leftmost) continue;
        ++rows;
        hidden_left += nearer_beyond(r, leftmost, -1) ? 1 : 0;
        hidden_right += nearer_beyond(r, rightmost, 1) ? 1 : 0;
    }
    detection.occluded_left = 2 * hidden_left >= rows;
    detection.occluded_right = 2 * hidden_right >= rows;
}

}  // namespace dlod
