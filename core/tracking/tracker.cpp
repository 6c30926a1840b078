#include "core/tracking/tracker.hpp"

namespace dlod {

struct Tracker::State {};

Tracker::Tracker(const SensorModel&, const TrackingConfig&) : state_(std::make_unique<State>()) {}
Tracker::~Tracker() = default;

void Tracker::process(Frame& frame) {
    frame.detection.tracks.clear();
    frame.detection.cleared.clear();
}

}  // namespace dlod
