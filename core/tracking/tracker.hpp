// Tracking and dynamic state (paper, Sec. "Tracking and State Update").
#pragma once

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

#include <memory>

namespace dlod {

struct TrackingConfig {
    double alpha = 0.8;
    double beta = 0.1;

    template <class V>
    void visit(V& v) {
        v.parameter("alpha", alpha, Range{0.0, 1.0}, "1", "weight of 1 - IoU in the association cost (Eq. 5)");
        v.parameter("beta", beta, Range{0.0, 1.0}, "1", "weight of the relative difference of point counts (Eq. 5)");
    }
};

/// Associates detections with tracks, filters them and decides their dynamic state. Fills frame.detection.tracks,
/// .detections[].track and .cleared. Frames in order.
class Tracker {
  public:
    Tracker(const SensorModel& sensor, const TrackingConfig& config);
    ~Tracker();
    void process(Frame& frame);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace dlod
