#include "core/odometry/held_directions.hpp"

#include <limits>

namespace dlod {
namespace {

struct Return {
    double demand;
    int frames;
};
constexpr Return kWithImu{3.0, 3};
constexpr Return kWithoutImu{6.0, 3};

}  // namespace

void HeldDirections::begin_frame() {
    observability_ = {};
    shows_all_ = false;
}

void HeldDirections::judge(const PlaneMatches& matches, const NormalEquations& equations, bool with_imu) {
    const Return needed = with_imu ? kWithImu : kWithoutImu;
    observability_ = Observability::of(matches, equations, adrift_ ? needed.demand : 1.0);
    shows_all_ = observability_.unobservable() == 0;
    if (adrift_ && frames_showing_all_ < needed.frames) {
        observability_ = Observability::of(matches, equations, std::numeric_limits<double>::infinity());
    }
}

void HeldDirections::end_frame() {
    adrift_ = observability_.unobservable() > 0;
    frames_showing_all_ = adrift_ && shows_all_ ? frames_showing_all_ + 1 : 0;
}

}  // namespace dlod
