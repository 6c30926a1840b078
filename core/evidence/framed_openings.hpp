// What is seen through the windows of something that stands.
//
// Glass lets a beam through, reflects it, or returns it, as the angle has it: what is seen of a parked car's windows,
// and of what is behind them, lies where an earlier frame looked through and saw nothing. None of that has moved, while
// the frame around the window has stayed where it was, or at least the body below it: of a car no taller than the
// sensor the roof is not seen.
#pragma once

#include <cstdint>
#include <span>

#include "core/evidence/evidence_image.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct FramedOpeningsConfig {
    double reach_m = 1.2;
    double depth_m = 2.0;
    double tolerance_m = 0.25;
    double slant_m = 1.0;

    template <class V>
    void visit(V& v) {
        v.parameter("reach_m", reach_m, Range{0.0, 5.0}, "m",
                    "a place with something that was there within this distance on all four sides lies in a window; "
                    "higher takes larger windows for some; 0: none is looked for");
        v.parameter("depth_m", depth_m, Range{0.0, 20.0}, "m",
                    "what is so much farther off than the window's frame is no longer behind its glass");
        v.parameter("tolerance_m", tolerance_m, Range{0.0, 2.0}, "m",
                    "the frame may be farther off than the glass by this");
        v.parameter("slant_m", slant_m, Range{0.0, 2.0}, "m", "likewise its upper side: windscreens lean back");
    }
};

class FramedOpenings {
  public:
    FramedOpenings(const SensorModel& sensor, const FramedOpeningsConfig& config);

    /// Starts a frame.
    void begin();
    /// Takes in what the last run() tested, and makes those pixels unknown that were found free in a window.
    /// Only an object's window counts, as a vehicle's: in a wall it may be a door.
    /// @param compact by segment: 1 of what is no larger than a person, which is no window's frame
    void take_back(const Frame& frame, std::span<const std::uint8_t> compact, EvidenceImage& evidence);

  private:
    static constexpr int kTileRows = 2;
    static constexpr int kTileColumns = 8;
    /// Ranges of what was there, in one tile of the image.
    struct Tile {
        float nearest_m = 1e9F;
        float farthest_m = -1e9F;
        bool was_free = false;  ///< something in the tile was found free
    };
    /// Whether within so many steps over the tiles something was there, between these ranges.
    bool met(int row, int column, int row_step, int column_step, int steps, float nearest_m, float farthest_m) const;
    /// Whether within so many tiles below something was there that may be the body which a window is in.
    bool is_above_body(int row, int column, int rows, float range_m) const;

    FramedOpeningsConfig config_;
    Image<Tile> tiles_;
    float tile_height_rad_;
    float tile_width_rad_;
};

}  // namespace dlod
