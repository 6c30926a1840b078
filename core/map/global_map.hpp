// The global map: static points out to a radius of the path, bounded in memory, cleared of the past of moving objects.
#pragma once

#include <memory>
#include <vector>

#include "core/map/cell_table.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct GlobalMapConfig {
    double cell_m = 0.2;
    double max_range_m = 45.0;
    double min_range_m = 0.3;
    int delay_frames = 5;
    double confirm_s = 0.8;
    double forget_s = 4.0;
    int max_points = 5'000'000;

    template <class V>
    void visit(V& v) {
        v.parameter("cell_m", cell_m, Range{0.05, 2.0}, "m", "one point is kept a cell; higher is coarser and smaller");
        v.parameter("max_range_m", max_range_m, Range{1.0, 300.0}, "m",
                    "points farther from the sensor are not mapped");
        v.parameter("min_range_m", min_range_m, Range{0.0, 10.0}, "m",
                    "nearer points, such as the robot's own, are not mapped");
        v.parameter("delay_frames", delay_frames, Range{0, 50}, "frames",
                    "points wait this long before they enter: what is found to move meanwhile never does");
        v.parameter(
            "confirm_s", confirm_s, Range{0.0, 60.0}, "s",
            "a surface enters the map once it has stayed this long; higher: fewer traces of what moves, and what "
            "was in view for a shorter time is missing. 0: at once");
        v.parameter("forget_s", forget_s, Range{0.1, 60.0}, "s",
                    "a surface that has not been confirmed is forgotten when it is not seen again for this long");
        v.parameter(
            "max_points", max_points, Range{1000, 500'000'000}, "points",
            "bound of the map's size: the cells farthest from the robot are forgotten first; 24 to 40 bytes each");
    }
};

/// Not thread-safe: one thread inserts, clears and reads.
class GlobalMap {
  public:
    GlobalMap(const SensorModel& sensor, const GlobalMapConfig& config);
    ~GlobalMap();
    /// Adds the frame's static points and clears the past of objects that turned dynamic (frame.detection.cleared).
    /// Both take effect some frames later; each frame adds a part of its pixels, another one each time.
    void update(const Frame& frame);
    /// Finishes whatever was postponed; call it before points().
    void finish();
    /// All points, in an order that depends on nothing but the frames.
    std::vector<MapPoint> points() const { return CellTable::sorted(snapshot()); }
    /// The same before they are put in order (CellTable::sorted), which takes most of the time and can be done elsewhere.
    std::vector<CellTable::Entry> snapshot() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace dlod
