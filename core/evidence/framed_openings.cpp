#include "core/evidence/framed_openings.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr double kLeastRow_rad = 1e-3;  // no sensor's rows are closer
constexpr float kBody_m = 0.3F;         // a body below a window is at least so high
constexpr float kLean_m = 0.3F;         // and no nearer than that: windows at the side lean in
constexpr float kProud_m = 0.15F;       // nor farther: what stands before it is none of its windows

}  // namespace

FramedOpenings::FramedOpenings(const SensorModel& sensor, const FramedOpeningsConfig& config)
    : config_(config),
      tiles_((sensor.height + kTileRows - 1) / kTileRows, (sensor.width + kTileColumns - 1) / kTileColumns),
      tile_height_rad_(static_cast<float>(kTileRows * std::max(kLeastRow_rad, sensor.row_rad()))),
      tile_width_rad_(static_cast<float>(kTileColumns * sensor.column_rad())) {}

void FramedOpenings::begin() {
    tiles_.fill({});
}

bool FramedOpenings::met(int row, int column, int row_step, int column_step, int steps, float nearest_m,
                         float farthest_m) const {
    const int width = tiles_.width();
    for (int i = 1; i <= steps; ++i) {
        // Beside it three rows of tiles: not every pixel is tested.
        const int aside = std::abs(column_step);
        const int c = (column + i * column_step + width) % width;
        for (int r = row + i * row_step - aside; r <= row + i * row_step + aside; ++r) {
            if (r < 0 || r >= tiles_.height()) continue;
            const Tile& tile = tiles_(r, c);
            if (tile.farthest_m >= nearest_m && tile.nearest_m <= farthest_m) return true;
        }
    }
    return false;
}

bool FramedOpenings::is_above_body(int row, int column, int rows, float range_m) const {
    int first = 0, last = 0;
    for (int i = 1; i <= rows && row + i < tiles_.height(); ++i) {
        const Tile& tile = tiles_(row + i, column);
        if (tile.was_free) {
            if (first > 0) return false;  // it moves itself
            continue;
        }
        if (tile.farthest_m < range_m - kLean_m || tile.nearest_m > range_m + kProud_m) continue;
        if (first == 0) first = i;
        last = i;
    }
    return last > first && static_cast<float>(last - first + 1) * tile_height_rad_ * range_m > kBody_m;
}

void FramedOpenings::take_back(const Frame& frame, std::span<const std::uint8_t> compact, EvidenceImage& evidence) {
    if (config_.reach_m <= 0.0) return;
    const auto width = static_cast<PixelIndex>(frame.cloud.range_m.width());
    const auto row_of = [&](PixelIndex pixel) { return static_cast<int>(pixel / width) / kTileRows; };
    const auto column_of = [&](PixelIndex pixel) { return static_cast<int>(pixel % width) / kTileColumns; };
    for (const PixelIndex pixel : evidence.tested()) {
        const std::size_t segment = frame.prepared.segment[pixel] - 1;
        if (compact[segment] != 0 || !frame.prepared.segments[segment].feasible) continue;
        const bool free = evidence[pixel] == Evidence::kFree;
        if (!free && !is_occupied(evidence[pixel])) continue;
        Tile& tile = tiles_(row_of(pixel), column_of(pixel));
        tile.was_free = tile.was_free || free;
        if (free) continue;
        const float range_m = frame.cloud.range_m[pixel];
        tile.nearest_m = std::min(tile.nearest_m, range_m);
        tile.farthest_m = std::max(tile.farthest_m, range_m);
    }
    for (const PixelIndex pixel : evidence.tested()) {
        if (evidence[pixel] != Evidence::kFree) continue;
        const int row = row_of(pixel);
        const int column = column_of(pixel);
        const float range_m = frame.cloud.range_m[pixel];
        const float reach_rad = static_cast<float>(config_.reach_m) / std::max(0.5F, range_m);
        const int rows = static_cast<int>(reach_rad / tile_height_rad_);
        const int columns = std::min(static_cast<int>(reach_rad / tile_width_rad_), tiles_.width() / 4);
        // Too far off for a window to be told from what stands beside it.
        if (rows < 1 || columns < 1) continue;
        const float nearest_m = range_m - static_cast<float>(config_.depth_m);
        const float farthest_m = range_m + static_cast<float>(config_.tolerance_m);
        const float top_m = range_m + static_cast<float>(config_.slant_m);
        if (is_above_body(row, column, rows, range_m)) {
            evidence.set(pixel, Evidence::kUnknown);
            continue;
        }
        if (met(row, column, 1, 0, rows, nearest_m, farthest_m) && met(row, column, -1, 0, rows, nearest_m, top_m) &&
            met(row, column, 0, -1, columns, nearest_m, farthest_m) &&
            met(row, column, 0, 1, columns, nearest_m, farthest_m))
            evidence.set(pixel, Evidence::kUnknown);
    }
}

}  // namespace dlod
