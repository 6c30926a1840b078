// Which directions the prediction holds, from frame to frame.
#pragma once

#include "core/registration/observability.hpp"

namespace dlod {

/// A direction is let go of as soon as the matches do not show it. It is taken back reluctantly: what comes into view
/// in a tunnel are first of all people and vehicles, and for some frames these look like structure. So more has to face
/// it than would have kept it, for several frames on end. But while the IMU keeps the prediction good enough for what
/// moves not to match it, little is enough: in a street where little faces along it each frame without that little
/// drifts.
class HeldDirections {
  public:
    /// Judges the matches of a stage's first iteration.
    /// @param sure the prediction, by the IMU, is good enough to tell what moves
    void judge(const PlaneMatches& matches, const NormalEquations& equations, bool sure);
    /// The last judgement.
    const Observability& observability() const { return observability_; }
    /// Nothing has been judged in this frame yet.
    void begin_frame();
    /// The frame has been registered after the last judgement.
    void end_frame();
    /// Nothing is known of earlier frames.
    void reset() { *this = {}; }

  private:
    Observability observability_;
    bool adrift_ = false;
    bool shows_all_ = false;  ///< enough faces all directions, for taking them back
    int frames_showing_all_ = 0;
};

}  // namespace dlod
