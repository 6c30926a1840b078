// Whether the map holds what stands still, and nothing that moved.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>

#include "tools/eval/truth.hpp"

namespace dlod::tools {

/// Over one point a 0.25 m cell, so that the map's density does not matter. A ghost has no true static point but a true
/// moving one within 0.25 m.
struct MapScore {
    int points = 0;
    int ghosts = 0;
    double kept_pct = 0.0;  ///< true static points that the map covers within 0.5 m

    template <class V>
    void visit(V& v) const {
        v("map_points", points);
        v("ghost_points", ghosts);
        v("ghost_pct", points > 0 ? 100.0 * ghosts / points : 0.0);
        v("kept_pct", kept_pct);
    }
};

/// Scores the PCD file `map`, whose world is the run's. Throws std::runtime_error naming the file that is missing,
/// malformed or empty.
MapScore score_map(const Truth& truth, const std::filesystem::path& map, const Eigen::Isometry3d& T_true_run);

}  // namespace dlod::tools
