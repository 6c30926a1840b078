// Vehicles that follow lanes, each other, and lights.
#pragma once

#include <utility>
#include <vector>

#include "tools/sim/actor.hpp"
#include "tools/sim/arc_path.hpp"

namespace dlod::tools::sim {

/// A light, or whatever stops a lane: closed from the first time to the second.
struct StopLine {
    double s_m = 0.0;
    std::vector<std::pair<double, double>> closed_s;
};

struct Driver {
    double s_m = 0.0;  ///< middle of the vehicle along the lane at the drive's start
    double length_m = 4.5;
    double speed_mps = 8.0;  ///< on a free road
    double stride_m = 2.0;   ///< of its wheels
};

/// Drives a lane's vehicles through a drive (Intelligent Driver Model). `drivers` from the foremost to the last.
/// @return their motions, valid from -1 s to a second after the end
std::vector<Motion> drive_lane(const ArcPath& lane, const std::vector<Driver>& drivers,
                               const std::vector<StopLine>& stops, double duration_s);

}  // namespace dlod::tools::sim
