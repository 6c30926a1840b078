// One track: its filter, what it remembers of the object's extent and past, and the belief that it moves.
#pragma once

#include <span>

#include "core/removal/box_history.hpp"
#include "core/tracking/association.hpp"
#include "core/tracking/detection_shapes.hpp"
#include "core/tracking/dynamic_state.hpp"
#include "core/tracking/expected_sight.hpp"
#include "core/tracking/object_extent.hpp"
#include "core/tracking/registered_displacement.hpp"
#include "core/tracking/set_off.hpp"
#include "core/tracking/walked_way.hpp"

namespace dlod {

/// The detections of one frame that belong to one track: an occluder may split an object into several.
struct Sighting {
    std::span<const std::size_t> detections;  ///< indices into the frame's, the largest part first; at least one
    std::size_t shape_parts = 1;  ///< so many of them, the first ones, say where and how large the object is
    bool cut = false;             ///< its largest part was cut out of a larger detection by the object's box
    bool apart = false;           ///< or is one of two objects that may have been taken for one
    Visibility visibility;
};

class TrackedObject {
  public:
    /// Born from its first sighting.
    TrackedObject(std::uint32_t id, const Frame& frame, const DetectionShapes& shapes, const Sighting& sighting,
                  const TrackingConfig& config);

    /// Moves on to the next frame's stamp.
    void predict(double dt_s, const TrackingConfig& config);

    /// Takes in this frame's sighting. Where the object has just turned dynamic, the boxes of its past go to `cleared`.
    void see(const Frame& frame, const DetectionShapes& shapes, const Sighting& sighting, const TrackingConfig& config,
             std::vector<OrientedBox>& cleared);

    /// No detection in this frame. @param sight at its predicted box: what something nearer hides does not age, what is
    /// gone ages twice
    void miss(Sight sight);

    /// Of two tracks on one object that which was dynamic, and has been seen for longer, is known to others.
    bool goes_before(const TrackedObject& other) const;
    /// The other's past is this one's, too: it is to be cleared where this object moves.
    void take_past(TrackedObject& other, std::vector<OrientedBox>& cleared);
    /// What had a track of its own is a part of it: it is so much larger.
    void join(const OrientedBox& part);

    bool dead(const TrackingConfig& config) const;
    /// Worth telling others of: seen, or dynamic and not known to be gone.
    bool visible_to_others() const;
    /// Seen often enough, or clearly enough, to believe in it as an object of its own.
    bool steady() const { return hits_ >= 3 || born_apart_; }

    ExpectedTrack expected() const;
    Track published() const;
    std::uint32_t id() const { return id_; }
    DynamicState state() const { return belief_.state(); }
    OrientedBox box() const { return filter_.box(); }
    Eigen::Vector3d velocity() const { return filter_.velocity(); }
    double velocity_sd() const { return filter_.velocity_sd(); }
    /// It is as large as a vehicle, has moved beyond doubt, and is dynamic: it may have stopped a moment ago.
    bool is_moving_vehicle() const;
    /// That, and it is under way.
    bool drives() const;
    /// It is known to be as small as people are, and as tall.
    bool is_body() const;
    /// It moves, as fast as people walk at least.
    bool under_way() const;
    /// As large as a vehicle, it was at rest and clearly is no longer, though it does not count as dynamic yet.
    bool sets_off() const;
    bool seen() const { return seen_now_; }  ///< in this frame
    int misses() const { return misses_; }
    int hits() const { return hits_; }

  private:
    /// Which way the object points, from its motion or its sides, and the noise of that; aligns the filter's axes.
    std::pair<double, double> measured_yaw(const PointSpan& points);
    /// Of what moves, more is there than one side shows.
    void assume_extent(const Visibility& visibility);
    /// What is no larger than a person when it begins to move was taken together with what it stood at.
    void leave_background(const Visibility& visibility);
    bool clear_without_displacement(const MotionCues& cues) const;
    /// What it looked like while it moved says nothing of how it rests.
    void come_to_rest();
    /// It is known to move, and rests or has set off just now.
    bool rests_awhile() const;
    /// How it rests is looked at in this frame.
    bool watched_at_rest() const;
    /// Registers this frame's points to earlier ones, and renews those.
    /// @param age_s of the points before the stamp
    void displacement_cue(const Frame& frame, const Sighting& sighting, double age_s, const DynamicStateConfig& config,
                          MotionCues& cues);
    /// Visible box of all parts at one yaw.
    static OrientedBox visible_box(const Frame& frame, const DetectionShapes& shapes, const Sighting& sighting,
                                   double yaw_rad);

    std::uint32_t id_;
    OrientedBox visible_;  ///< of the last sighting; its centre is an offset from the filter's
    KalmanFilter filter_;
    MotionBelief belief_;
    BoxHistory history_;
    OrientedBox first_visible_;  ///< as it was seen first, world frame
    bool born_apart_;            ///< beside an object that it had been taken for a part of
    PointSample before_;         ///< points of half a second to a second ago, or of the first sighting
    PointSample since_;          ///< those that follow them
    Eigen::Vector2d before_center_m_ = Eigen::Vector2d::Zero(), since_center_m_ = Eigen::Vector2d::Zero();
    Eigen::Vector2d registered_velocity_mps_ = Eigen::Vector2d::Zero();  ///< by the last registration, 0 if not clear
    int agreeing_ = 0;  ///< frames in a row in which it agreed with the filter's or that of the frame before
    WalkedWay walked_way_;
    SetOff set_off_;
    double lifetime_s_ = 0.0;
    bool was_dynamic_ = false;
    bool has_moved_ = false;  ///< beyond doubt, by its velocity
    double unseen_s_ = 0.0;
    double residual_m_ = 0.0;
    int points_ = 0;  ///< of the last sighting
    bool seen_now_ = true;
    Sight sight_ = Sight::kThere;  ///< at the last miss
    int hits_ = 0;
    int misses_ = 0;
    int unseen_frames_ = 0;
    int age_ = 0;
};

}  // namespace dlod
