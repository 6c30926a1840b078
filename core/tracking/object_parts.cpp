#include "core/tracking/object_parts.hpp"

#include <algorithm>

#include "core/tracking/box_iou.hpp"
#include "core/tracking/vehicle_parts.hpp"

namespace dlod {
namespace {

constexpr double kPartMargin_m = 0.15;     // a part's middle lies at most this far outside of the whole object's box
constexpr double kLimbMargin_m = 0.4;      // and that of a small piece beside a moving object
constexpr double kSplinterMargin_m = 0.8;  // and of a splinter at the corners of a vehicle, or of a part that moves
constexpr unsigned kSplinter = 10;         // that is so much smaller
constexpr unsigned kLimb = 3;              // small: a third of the object's pixels
constexpr double kLowLimb = 0.5;           // of the object's height
constexpr double kLeastBody = 0.6;         // of the height of the object beside it
constexpr double kInside = 0.6;            // of its footprint lies inside of those margins
constexpr double kInsideVehicle = 0.8;     // or of a moving vehicle's box itself
constexpr double kMaxGap_m = 0.5;          // between the heights of two parts
constexpr int kYoungHits = 10;
constexpr double kOpposite = -0.2;        // product of what evidence says of two that are not one
constexpr double kBody_m = 1.2;           // people are no broader
constexpr double kFree = 0.5;             // evidence of what stands where it was free
constexpr double kAtRest = -0.9;          // evidence of what stands where something stood before
constexpr double kMoreAtRest = 0.5;       // by that much of the evidence
constexpr double kStackedOverlap = 0.25;  // share of the smaller height that two halves of one object have in common
constexpr double kStackedShift_m = 0.4;   // and between their middles in the ground plane

bool is_dynamic(const TrackedObject& object) {
    return object.state() == DynamicState::kDynamic;
}

/// One above the other, as a rider and his legs or the halves of a person: separate objects do not stand like that.
bool stacked(const OrientedBox& a, const OrientedBox& b) {
    return height_gap_m(a, b) > -kStackedOverlap * std::min(a.size_m.z(), b.size_m.z()) &&
           (a.center_m - b.center_m).head<2>().norm() < kStackedShift_m;
}

/// It moves, is as tall as the other, and has been seen for long: an object of its own, whatever an occluder has left
/// of either.
bool is_body_beside(const TrackedObject& host, const TrackedObject& guest) {
    return is_dynamic(guest) && guest.hits() >= kYoungHits &&
           guest.box().size_m.z() > kLeastBody * host.box().size_m.z();
}

/// A body that moves, seen by itself.
bool is_moving_body(const Detection& detection, const CandidateDetection& evidence) {
    return evidence.motion > kFree && detection.box.longest_m() < std::min(kBody_m, detection.box.size_m.z());
}

}  // namespace

PartHost::PartHost(const TrackedObject& object, const ExpectedTrack& expected, const Detection& seen,
                   const CandidateDetection& evidence)
    : object_(&object),
      expected_(&expected),
      seen_(&seen),
      evidence_(&evidence),
      reach_m_(dlod::reach_m(expected.whole) + kSplinterMargin_m) {}

bool PartHost::is_in_reach(const Detection& part) const {
    return (expected_->whole.center_m - part.centroid_m).head<2>().squaredNorm() <= reach_m_ * reach_m_;
}

/// The rest of a large object of which the front alone was found to move.
bool PartHost::is_rest(const Detection& part) const {
    return part.segment == seen_->segment &&
           (is_rest_of(*object_, *seen_, part) || sets_off_with(*object_, *seen_, part));
}

/// What evidence says of the two does not go together.
bool PartHost::contradicts(const Detection& part, const CandidateDetection& evidence) const {
    if (evidence.motion * expected_->motion < kOpposite || is_backdrop(part, evidence)) return true;
    // Nor is a body that moves a part of what has not been seen to.
    return !is_dynamic(*object_) && evidence_->motion <= 0.0 && is_moving_body(part, evidence);
}

/// Larger than what is seen of the object, and more at rest than that: a wall that it comes near to.
bool PartHost::is_backdrop(const Detection& part, const CandidateDetection& evidence) const {
    return part.count > seen_->count && evidence.motion <= kAtRest && evidence.motion + kMoreAtRest < evidence_->motion;
}

/// A track that sees something low, and is expected inside of a moving object's box, has followed an arm or a leg.
bool PartHost::is_limb(const Detection& part, const TrackedObject& guest) const {
    return kLimb * part.count < seen_->count && is_dynamic(*object_) && object_->hits() >= kYoungHits &&
           part.box.size_m.z() < kLowLimb * object_->box().size_m.z() &&
           share_inside(guest.box(), object_->box(), kPartMargin_m) > kInside;
}

/// How far outside of the object's box a part may lie; nothing where the track on it is an object of its own.
std::optional<double> PartHost::margin_m(const Detection& part, const TrackedObject* guest, bool rest) const {
    double margin = rest ? kLimbMargin_m : kPartMargin_m;
    if (guest != nullptr) {
        const bool on_top =
            object_->id() < guest->id() && stacked(seen_->box, part.box) && !is_body_beside(*object_, *guest);
        const bool young = guest->hits() < kYoungHits && object_->hits() >= 2 * guest->hits();
        if (!on_top && !young && !is_limb(part, *guest) && !one_vehicle(*object_, *guest)) return std::nullopt;
        if (on_top) margin = kLimbMargin_m;
    } else if (is_dynamic(*object_) && kLimb * part.count < seen_->count) {
        margin = kLimbMargin_m;
    }
    if (object_->drives()) margin = kSplinter * part.count < seen_->count ? kSplinterMargin_m : kLimbMargin_m;
    return margin;
}

std::optional<PartFit> PartHost::fit(const Detection& part, const CandidateDetection& evidence,
                                     const TrackedObject* guest, double nearer_than) const {
    if (!is_in_reach(part)) return std::nullopt;
    // What is known to move is no part of what is not.
    if (guest != nullptr && guest->hits() >= kYoungHits && is_dynamic(*guest) && !is_dynamic(*object_))
        return std::nullopt;
    const OrientedBox& box = expected_->whole;
    const bool rest = is_rest(part);
    // Where a vehicle that moves is there is nothing else, even if it has been there itself before: of what crawls a
    // whole side has.
    const bool covered = object_->is_moving_vehicle() && share_inside(part.box, box, 0.0) > kInsideVehicle;
    if (!rest && !covered && contradicts(part, evidence)) return std::nullopt;
    if (height_gap_m(box, part.box) > kMaxGap_m) return std::nullopt;
    std::optional<double> margin = margin_m(part, guest, rest);
    if (!margin) return std::nullopt;
    if (rest && evidence.motion > kFree) margin = kSplinterMargin_m;
    const double distance_m = footprint_distance_m(box, part.centroid_m);
    if (distance_m >= nearer_than * *margin || share_inside(part.box, box, *margin) <= kInside) return std::nullopt;
    return PartFit{.distance = distance_m / *margin, .limb = distance_m > kPartMargin_m && !rest && !object_->drives()};
}

}  // namespace dlod
