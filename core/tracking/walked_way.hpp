// Has a small thing that is seen whole gone farther than it is large? Of a few dozen points no registration says so.
#pragma once

#include "core/types/oriented_box.hpp"

namespace dlod {

/// What is seen of a thing in one frame.
struct WholeSight {
    OrientedBox visible;                                 ///< world frame
    Eigen::Vector2d sensor_m = Eigen::Vector2d::Zero();  ///< its position, world frame
    double time_s = 0.0;                                 ///< of the points
};

/// Compares what is seen of a thing with what was seen of it one to two seconds ago. The middle of what is seen of a
/// post, a trunk or a bin lies within it wherever it is seen from: what has moved by more than its own size, both ends
/// by the same, at the velocity that its track has, has walked. Patterns of the beams on walls and hedges move with the
/// sensor: what does counts for nothing.
class WalkedWay {
  public:
    /// @param whole nothing hides a part of it, and it is no part of something larger
    /// @param velocity_mps of the track, ground plane
    /// @return it has walked
    bool update(const WholeSight& now, bool whole, const Eigen::Vector2d& velocity_mps);

  private:
    bool steady(const WholeSight& now, const Eigen::Vector2d& velocity_mps) const;

    WholeSight before_, since_;
    bool started_ = false;
    double last_s_ = 0.0;  ///< seen
    int steady_ = 0;       ///< frames in a row
};

}  // namespace dlod
