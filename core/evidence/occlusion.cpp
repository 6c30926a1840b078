#include "core/evidence/occlusion.hpp"

#include <algorithm>

namespace dlod {

namespace {

/// Of the pixels at the begin that follow each other.
std::size_t run_length(std::span<const PixelIndex> pixels) {
    constexpr std::size_t kBlock = 8;
    std::size_t n = 1;
    while (n + kBlock <= pixels.size()) {
        PixelIndex off = 0;
        for (std::size_t k = 0; k < kBlock; ++k) off |= pixels[n + k] ^ (pixels[0] + static_cast<PixelIndex>(n + k));
        if (off != 0) break;
        n += kBlock;
    }
    while (n < pixels.size() && pixels[n] == pixels[n - 1] + 1) ++n;
    return n;
}

}  // namespace

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
    int top = height;
    int bottom = -1;
    for (std::size_t i = 0; i < pixels.size();) {
        const auto p = static_cast<int>(pixels[i]);
        const int row = p / width;
        int first = p - row * width;
        const std::size_t run =
            run_length(pixels.subspan(i, std::min(pixels.size() - i, static_cast<std::size_t>(width - first))));
        i += run;
        first -= reference;
        if (first >= width / 2) first -= width;
        if (first < -width / 2) first += width;
        const int last = first + static_cast<int>(run) - 1;
        // The run passes the column opposite to the first pixel: it reaches both ends.
        const bool around = last > (width - 1) / 2;
        const auto at = static_cast<std::size_t>(row);
        left[at] = std::min(left[at], around ? -width / 2 : first);
        right[at] = std::max(right[at], around ? (width - 1) / 2 : last);
        top = std::min(top, row);
        bottom = std::max(bottom, row);
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
