// Which detections are parts of an object beside the one that it was found by: pieces that an occluder splits off,
// limbs, the rest of a vehicle of which only the front moves visibly.
#pragma once

#include <optional>

#include "core/tracking/association.hpp"
#include "core/tracking/tracked_object.hpp"

namespace dlod {

/// How well a detection fits as a part of an object.
struct PartFit {
    double distance = 1.0;  ///< of its middle from the object's footprint, in units of what is allowed
    bool limb = false;      ///< it lies beside the object's box: belongs to it, but does not shape it
};

/// An object that has been found in this frame, and may have other parts.
class PartHost {
  public:
    /// All are kept by reference.
    /// @param expected of the object, in this frame
    /// @param seen, evidence the detection that it was found by
    PartHost(const TrackedObject& object, const ExpectedTrack& expected, const Detection& seen,
             const CandidateDetection& evidence);

    /// What lies inside of the object's box is a part of it; small pieces beside a moving one are its limbs. A young
    /// track on such a piece gives it up, and so do the younger of two tracks that stand on top of one another and the
    /// smaller of two that are pieces of one vehicle.
    /// @param guest the track that the detection belongs to now, nullptr for none
    /// @param nearer_than distance, as in the result, of the best fit so far
    /// @return nothing where it is no part of this object, or a better one of another
    std::optional<PartFit> fit(const Detection& part, const CandidateDetection& evidence, const TrackedObject* guest,
                               double nearer_than) const;

  private:
    bool is_in_reach(const Detection& part) const;
    bool is_rest(const Detection& part) const;
    bool contradicts(const Detection& part, const CandidateDetection& evidence) const;
    std::optional<double> margin_m(const Detection& part, const TrackedObject* guest, bool rest) const;
    bool is_limb(const Detection& part, const TrackedObject& guest) const;
    bool is_backdrop(const Detection& part, const CandidateDetection& evidence) const;

    const TrackedObject* object_;
    const ExpectedTrack* expected_;
    const Detection* seen_;
    const CandidateDetection* evidence_;
    double reach_m_;  ///< how far from the middle of its box a part's middle may be
};

}  // namespace dlod
