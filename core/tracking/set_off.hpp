// Has what was at rest set off? The free space says little of that: the object's own past is what was seen where it is.
#pragma once

#include "core/tracking/dynamic_state.hpp"
#include "core/tracking/registered_displacement.hpp"

namespace dlod {

/// Watches the registrations of an object at rest. Its points lie on the planes of some moments ago up to a noise that
/// depends on its shape and on how the view of it changes, and few of them lie where free space was seen; both are
/// measured meanwhile. It seems to set off where its points are displaced beyond doubt, where they no longer fit its
/// shape at rest, as those of somebody whose legs begin to swing, or where it enters free space; it does in two frames
/// in a row, since one may show another part of it.
class SetOff {
  public:
    /// It has come to rest.
    void rest() { *this = {}; }
    /// Takes in the registration and the free-space evidence of a frame. @return it sets off
    bool update(const RegisteredDisplacement& r, const MotionCues& cues);
    /// In the last frame it seemed to: its points at rest are to be kept for the next.
    bool suspected() const { return suspected_ > 0; }
    /// In the last frame its points were displaced from a place where they had stood still for long.
    bool left_its_place() const;

  private:
    double noise_m2_ = 0.0;    ///< mean squared distance at rest
    double free_share_ = 0.0;  ///< mean share of the points in free space at rest
    int at_rest_ = 0;          ///< frames that they come from
    int suspected_ = 0;        ///< frames in a row
    bool displaced_ = false;
};

}  // namespace dlod
