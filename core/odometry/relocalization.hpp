// The search for a robot that has lost its map.
#pragma once

#include <cstdint>

#include "core/odometry/frame_registration.hpp"
#include "core/odometry/motion_filter.hpp"

namespace dlod {

/// The prediction may be too far off for the registration to find the way: looks around it, as far as the robot may be
/// by the prediction's uncertainty. What is found counts if it explains clearly more than whatever is found elsewhere.
class Relocalization {
  public:
    /// Looking around costs some frames' time: not in each of them.
    bool is_due(std::int64_t stamp_ns) const;
    /// @param filter predicted for the present scan; where the robot is found it is moved there, and its update is left
    /// unfinished
    /// @return whether it is found; if not, filter and held directions are as before
    bool find(FrameRegistration& registration, MotionFilter& filter, VoxelMap& submap);

  private:
    std::int64_t searched_ns_ = 0;
};

}  // namespace dlod
