// Dynamic state of a track: undefined, static or dynamic (paper, Sec. "Dynamic State Update").
//
// With the residual as the only cue this is the paper's rule: dynamic, for good, after n_min detections, an average
// residual of at least theta_res * h_S (Eq. 6) and a shift of theta_disp from where the track began; static after n_max
// detections. With more cues each detection adds to the log-odds of motion, and the decision can be taken back.
#pragma once

#include "core/tracking/tracking_config.hpp"
#include "core/types/track.hpp"

namespace dlod {

/// What one detection says about motion.
struct MotionCues {
    double average_residual_m = 0.0;
    int residual_points = 0;
    double height_m = 0.0;            ///< h_S of Eq. 6
    bool residual_would_show = true;  ///< if it moved: false where it would not have gone far enough yet
    int free_points = 0;              ///< pixels where earlier frames saw free space
    int occupied_points = 0;          ///< pixels where they saw a surface
    int unknown_points = 0;
    bool turned = false;   ///< a plane that has turned since two earlier frames
    double shift_m = 0.0;  ///< of what is seen, from where the track began, ground plane: both ends of its box
    double displacement_log_odds = 0.0;   ///< of "moved" against "stayed", from the registration of its own points
    bool sustained_displacement = false;  ///< it has agreed with the filtered velocity for a while
    bool left_its_place = false;          ///< and is longer than that what it hides could feign
    bool set_off = false;                 ///< what rested is displaced from where it did
    bool stands = false;                  ///< its own points lie where they were, and its middle does
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< filtered centre, ground plane
    double longest_m = 0.0;                                ///< side of its box
    double dt_s = 0.0;                                     ///< since the detection before

    /// It has gone farther than it is large: as good as any registration.
    void take_walked_way();
};

/// Share of the tested points that lie where free space was seen; negative where too few were tested to tell.
double free_share(const MotionCues& cues);

/// Log-odds of motion that one detection adds, all cues that are switched on together.
double motion_log_odds(const MotionCues& cues, const DynamicStateConfig& config);

/// The belief about one track.
class MotionBelief {
  public:
    DynamicState state() const { return state_; }
    double log_odds() const { return log_odds_; }
    int detections() const { return detections_; }
    /// It has been dynamic for as long as it takes to be at rest, and has gone as far as it is long meanwhile: what
    /// moves, rests and moves again.
    bool known_to_move() const { return known_to_move_; }
    /// It was dynamic, and stands.
    bool rested() const { return rested_; }
    /// It is dynamic, and became it where it had rested, a moment ago.
    bool has_set_off() const;

    /// Takes in one detection; returns true where the track has just become dynamic.
    bool update(const MotionCues& cues, const DynamicStateConfig& config);

  private:
    DynamicState by_paper(const MotionCues& cues, const DynamicStateConfig& config) const;
    void rest(const MotionCues& cues, const DynamicStateConfig& config);
    DynamicState fused(const MotionCues& cues, const DynamicStateConfig& config);

    DynamicState state_ = DynamicState::kUndefined;
    double log_odds_ = 0.0;
    double rest_s_ = 0.0;
    double dynamic_s_ = 0.0;                               ///< in the state dynamic, the last time
    Eigen::Vector2d set_out_m_ = Eigen::Vector2d::Zero();  ///< where it became dynamic,
    double way_m_ = 0.0;                                   ///< and the farthest that it was from there since
    bool known_to_move_ = false;
    bool has_turned_ = false;  ///< as a door does
    int detections_ = 0;
    Eigen::Vector2d anchor_m_ = Eigen::Vector2d::Zero();  ///< where it has rested for rest_s_
    int off_anchor_ = 0;                                  ///< consecutive detections away from there
    bool has_set_off_ = false;                            ///< the last time that it became dynamic it had rested before
    bool rested_ = false;  ///< it was dynamic and came to rest: only a displacement moves it again
};

}  // namespace dlod
