// A hinged door.
#pragma once

#include "tools/sim/actor.hpp"

namespace dlod::tools::sim {

/// The motion is that of the hinge: its heading is the direction of the leaf.
class Door final : public Actor {
  public:
    Door(Motion motion, Terrain terrain, double width_m, double height_m);

    void place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const override;

    /// Of the middle of the leaf.
    double speed(double t) const override;

  private:
    double width_m_;
    double height_m_;
};

}  // namespace dlod::tools::sim
