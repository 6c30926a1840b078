// The global map: static points out to a radius of the path, bounded in memory, cleared of the past of moving objects.
#pragma once

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace dlod {

struct GlobalMapConfig {
    double cell_m = 0.2;
    double max_range_m = 45.0;
    int max_points = 20'000'000;

    template <class V>
    void visit(V& v) {
        v.parameter("cell_m", cell_m, Range{0.05, 2.0}, "m", "one point is kept a cell; higher is coarser and smaller");
        v.parameter("max_range_m", max_range_m, Range{1.0, 300.0}, "m", "points farther from the sensor are not mapped");
        v.parameter("max_points", max_points, Range{1000, 500'000'000}, "points", "bound of the map's size: the cells farthest from the robot are forgotten first");
    }
};

struct MapPoint {
    float x = 0.0F, y = 0.0F, z = 0.0F;  ///< world frame, metres
};

/// Not thread-safe: one thread inserts, clears and reads.
class GlobalMap {
  public:
    GlobalMap(const SensorModel& sensor, const GlobalMapConfig& config);
    ~GlobalMap();
    /// Adds the frame's static points and clears the past of objects that turned dynamic (frame.detection.cleared).
    void update(const Frame& frame);
    /// Finishes whatever was postponed; call it before points().
    void finish();
    /// All points, in an order that depends on nothing but the frames.
    std::vector<MapPoint> points() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace dlod
