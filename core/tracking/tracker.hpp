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
    /// @param first_id of the first track; the others count on from it
    Tracker(const SensorModel& sensor, const TrackingConfig& config, std::uint32_t first_id = 1);
    ~Tracker();
    void process(Frame& frame);
    /// The id of the next track to be born.
    std::uint32_t next_id() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace dlod
