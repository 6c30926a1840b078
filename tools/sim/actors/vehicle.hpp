// Cars, vans and buses, moving or parked, in one rigid piece.
#pragma once

#include "tools/sim/actor.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {

/// Meshes about the middle of the vehicle on the ground, x forward; sizes vary with `random`.
Mesh car_mesh(Random& random);
Mesh van_mesh(Random& random);
Mesh bus_mesh();

class Vehicle final : public Actor {
  public:
    /// `shape`: where the scene has put the mesh.
    Vehicle(std::string kind, Motion motion, Terrain terrain, int shape);

    void place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const override;
};

}  // namespace dlod::tools::sim
