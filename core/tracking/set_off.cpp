#include "core/tracking/set_off.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {

namespace {

constexpr double kLeast_m = 0.05;  // people sway by less
constexpr double kChi2 = 18.0;     // of two degrees of freedom, by chance in one of 8000 frames
constexpr double kMisfit = 4.0;    // ratio of variances of some twenty independent points, by chance in one of 500
constexpr double kMisfit_m2 = 0.03 * 0.03;
constexpr double kSigmas = 3.0;  // of the number of points in free space
constexpr double kNewest = 0.2;  // weight of a new frame in what is known of the rest
constexpr int kKnownFrames = 3;  // until it is known
constexpr int kFrames = 2;
constexpr int kLongFrames = 5;
constexpr double kStill_m2 = 0.03 * 0.03;  // more is noise of something that changes

}  // namespace

bool SetOff::left_its_place() const {
    return displaced_ && at_rest_ >= kLongFrames && noise_m2_ < kStill_m2;
}

bool SetOff::update(const RegisteredDisplacement& r, const MotionCues& cues) {
    if (r.points == 0) {
        suspected_ = 0;
        displaced_ = false;
        return false;
    }
    const bool known = at_rest_ >= kKnownFrames;
    displaced_ = r.displacement_m.norm() > kLeast_m && displacement_chi2(r) > kChi2;
    const bool misfit = known && r.stayed_m2 > std::max(kMisfit * noise_m2_, noise_m2_ + kMisfit_m2);
    const double share = free_share(cues);
    const double tested = cues.free_points + cues.occupied_points;
    const bool enters_free =
        known && share >= 0.0 && share > free_share_ + kSigmas * std::sqrt((free_share_ + 1.0 / tested) / tested);
    suspected_ = displaced_ || misfit || enters_free ? suspected_ + 1 : 0;
    if (suspected_ == 0) {
        const double weight = std::max(kNewest, 1.0 / (at_rest_ + 1));
        noise_m2_ += weight * (r.stayed_m2 - noise_m2_);
        free_share_ += weight * (std::max(0.0, share) - free_share_);
        ++at_rest_;
    }
    return suspected_ >= kFrames;
}

}  // namespace dlod
