// Tracking and dynamic state (paper, Sec. "Tracking and State Update").
#pragma once

#include <memory>

#include "core/tracking/tracking_config.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Associates detections with tracks, filters them and decides their dynamic state. Frames in order.
///
/// Gives each detection its box, centroid and height (world frame); fills frame.detection.tracks, .detections[].track
/// and .cleared. May divide a detection that covers several tracks: .detections and the order of .pixels change then.
/// A frame whose odometry is not valid moves tracks by prediction only.
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
