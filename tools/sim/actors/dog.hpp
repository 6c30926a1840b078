// A dog.
#pragma once

#include "tools/sim/actor.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {

class Dog final : public Actor {
  public:
    Dog(Motion motion, Terrain terrain, Random& random);

    void place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const override;

    static double stride_m(double speed_mps) { return 0.4 + 0.35 * speed_mps; }

  private:
    double shoulder_m_;  ///< height of its back
};

}  // namespace dlod::tools::sim
