// The first two scans of a map.
#pragma once

#include <cstdint>
#include <optional>

#include "core/map/keyframe_database.hpp"
#include "core/odometry/frame_registration.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/placed_scan.hpp"

namespace dlod {

/// The first scan of a map can not be deskewed for its motion, which is not known yet: the second one tells it, and
/// both are done again. What counts is the way from one pose to the other; two scans that are skewed alike would fit at
/// any velocity.
class Bootstrap {
  public:
    /// @param any a filter for the same body
    explicit Bootstrap(const MotionFilter& any) : first_filter_(any) {}

    /// A map begins with this scan, placed after the motion that the filter, at its stamp, has.
    void begin(const PlacedScan& scan, const MotionFilter& filter);
    /// The map is one scan that has not been deskewed for its velocity.
    bool pending() const { return pending_; }
    void end() { pending_ = false; }

    /// Registers the present scan with the first one and deskews that for the motion that it had. The update of the
    /// filter is left unfinished.
    /// @param at_rest says the IMU
    void align(FrameRegistration& registration, MotionFilter& filter, KeyframeDatabase& map, bool at_rest);
    /// More than one body tells the motion that has been found; else it may be that body's.
    bool is_told() const { return told_; }
    /// Stamp of the first scan, if it was published deskewed for a motion that was not its own: its points are off by
    /// more than a little.
    std::optional<std::int64_t> void_scan_ns() const;

  private:
    /// What the second scan is registered with.
    struct Second {
        FrameRegistration& registration;
        MotionFilter& filter;
        KeyframeDatabase& map;
    };
    MotionFilter likeliest_start(const Second& second);
    void settle(const Second& second, int passes, int iterations_a_pass);
    void begin_again(const Second& second);

    bool pending_ = false;
    bool told_ = true;
    MotionFilter first_filter_;    ///< at the stamp of the first scan
    MotionState published_;        ///< what the first scan was published with
    PointSelection first_points_;  ///< of the first scan
    PlacedScan first_;
};

}  // namespace dlod
