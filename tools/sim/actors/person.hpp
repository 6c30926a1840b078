// A person who walks, runs or stands.
#pragma once

#include <array>

#include "tools/sim/actor.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {

class Person final : public Actor {
  public:
    /// Size, build and clothes are drawn from `random`.
    Person(Motion motion, Terrain terrain, Random& random);

    void place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const override;

    /// Metres that a gait cycle of two steps covers at a speed.
    static double stride_m(double speed_mps) { return 0.75 + 0.45 * speed_mps; }

  private:
    struct Leg {
        double hip_rad;
        double knee_rad;
    };
    Leg leg(double phase, double speed_mps) const;

    double height_m_;
    double build_;
    double arm_swing_;
    double stance_phase_;  ///< tells apart how people stand
    bool backpack_;
};

}  // namespace dlod::tools::sim
