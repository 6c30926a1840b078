// Two-stage odometry (paper, Sec. "Overview", Eq. 4): scan to scan, then scan to submap with the first as prior.
#pragma once

#include <cstdint>
#include <optional>

#include "core/map/keyframe_database.hpp"
#include "core/odometry/bootstrap.hpp"
#include "core/odometry/feedback.hpp"
#include "core/odometry/frame_registration.hpp"
#include "core/odometry/imu_use.hpp"
#include "core/odometry/levelling.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/moving_points.hpp"
#include "core/odometry/odometry_config.hpp"
#include "core/odometry/pose_uncertainty.hpp"
#include "core/odometry/registered_motion.hpp"
#include "core/odometry/relocalization.hpp"
#include "core/odometry/spaciousness.hpp"
#include "core/odometry/standstill.hpp"
#include "core/odometry/usual_quality.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Estimates the pose of each frame in turn and keeps the local map. Fills frame.odometry.
class Odometry {
  public:
    Odometry(const SensorModel& sensor, const OdometryConfig& config);
    Odometry(const Odometry&) = delete;
    Odometry& operator=(const Odometry&) = delete;

    /// @param feedback of the frame kFeedbackDelay before this one, or nullptr for the first frames
    void process(Frame& frame, const OdometryFeedback* feedback);

  private:
    /// What becomes of one frame.
    struct Course {
        bool registered = false;
        bool trusted = true;                       ///< false: what this frame gives is not to be used
        bool fits = true;                          ///< as well as scans do usually
        bool begins_map = false;                   ///< the map begins with it
        std::optional<std::int64_t> void_scan_ns;  ///< as in the result
        std::uint32_t flags = 0;
        MatchQuality quality;  ///< of the last registration
    };

    void apply(const OdometryFeedback& feedback);
    void begin_world(const Frame& frame);
    void follow(const Frame& frame);
    void begin_map(const Frame& frame, const Eigen::Isometry3d& T_world_sensor, const Matrix6d& covariance);
    void begin_map_here(const Frame& frame, const Matrix6d& moved);
    void renew_map(const Frame& frame);
    bool register_frame(const Frame& frame);
    bool starts_badly(const Frame& frame) const;
    bool contradicts_map() const;
    void judge();
    bool stands(const Frame& frame);
    void accept();
    void see_uncertainty();
    bool doubts_imu() const;
    void retry_without_imu(const Frame& frame, const MotionFilter& before, bool absurd);
    bool find_again(const Frame& frame);
    void level(const Frame& frame);
    void begin_world_at_rest(const Frame& frame);
    void begin_levelled_world(const Frame& frame);
    void remember(const Frame& frame);
    void write_result(Frame& frame);
    void write_keyframe_points(Frame& frame) const;
    void write_nothing(Frame& frame) const;
    bool is_usable(const Matrix6d& deviation) const;

    SensorModel sensor_;
    OdometryConfig config_;
    ImuUse imu_;
    MotionFilter filter_;
    FrameRegistration registration_;
    KeyframeDatabase keyframes_;
    MovingPoints moving_;
    Standstill standstill_;
    Bootstrap bootstrap_;
    Levelling levelling_;
    Relocalization relocalization_;
    UsualQuality usual_;
    RegisteredMotion registered_motion_;
    PoseUncertainty uncertainty_;
    Spaciousness spaciousness_;

    bool started_ = false;
    bool sure_ = false;         ///< scans have shown where the robot is since that was last in doubt
    std::int64_t sure_ns_ = 0;  ///< stamp of the last frame for which they had, or that the map began with
    std::optional<std::int64_t> missing_since_ns_;  ///< stamp of the first of the last scans that found no place
    std::uint64_t world_sequence_ = 0;              ///< of the frame that the world began with
    std::uint64_t map_sequence_ = 0;                ///< of the frame that the map began with
    Course now_;
};

}  // namespace dlod
