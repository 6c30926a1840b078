// A motion that explains itself: what it changes about the scans has to give the same motion again.
#pragma once

#include "core/types/lie.hpp"

namespace dlod {

/// Steps towards the motion f(m) = m, where each step is known only by evaluating f. Where f goes too far, and the
/// farther each time, of a step that the next one takes back only what is left counts (Anderson acceleration of depth
/// 1).
class MotionIteration {
  public:
    /// @param motion that was tried: velocity, m/s, then turn rate, rad/s; one counts as much as the other
    /// @param change f(motion) - motion
    /// @return the motion to try next
    Vector6d next(const Vector6d& motion, const Vector6d& change);

  private:
    bool first_ = true;
    Vector6d motion_ = Vector6d::Zero();
    Vector6d change_ = Vector6d::Zero();
};

}  // namespace dlod
