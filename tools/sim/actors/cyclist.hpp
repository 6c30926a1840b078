// A person on a bicycle.
#pragma once

#include "tools/sim/actor.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {

/// The bicycle without its wheels, and one wheel about the origin: shapes that a scene adds for its cyclists.
Mesh bicycle_frame_mesh();
Mesh bicycle_wheel_mesh();

class Cyclist final : public Actor {
  public:
    /// `frame_shape` and `wheel_shape`: where the scene has put the two meshes.
    Cyclist(Motion motion, Terrain terrain, int frame_shape, int wheel_shape, Random& random);

    void place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const override;

    /// Metres that a turn of the wheel covers; the motion's phase counts wheel turns.
    static double stride_m() { return 2.1; }
};

}  // namespace dlod::tools::sim
