#include "core/odometry/held_directions.hpp"

#include <limits>

namespace dlod {
namespace {

// What it takes to take a direction back where the prediction is not sure: so many times what would have kept it, in so
// many frames on end.
constexpr double kDemand = 6.0;
constexpr int kFrames = 3;

}  // namespace

void HeldDirections::begin_frame() {
    observability_ = {};
    shows_all_ = false;
}

void HeldDirections::judge(const PlaneMatches& matches, const NormalEquations& equations, bool sure) {
    const bool reluctant = adrift_ && !sure;
    observability_ = Observability::of(matches, equations, reluctant ? kDemand : 1.0);
    shows_all_ = observability_.unobservable() == 0;
    if (reluctant && frames_showing_all_ < kFrames) {
        observability_ = Observability::of(matches, equations, std::numeric_limits<double>::infinity());
    }
}

void HeldDirections::end_frame() {
    adrift_ = observability_.unobservable() > 0;
    frames_showing_all_ = adrift_ && shows_all_ ? frames_showing_all_ + 1 : 0;
}

}  // namespace dlod
