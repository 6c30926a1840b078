// How well the dynamic tracks are the objects that move.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/eval/motion_errors.hpp"
#include "tools/eval/run_output.hpp"
#include "tools/eval/truth.hpp"

namespace dlod::tools {

/// True objects that move now (over 0.1 m/s), show at least 40 points and lie within range, against tracks in state
/// dynamic, matched frame by frame by the distance of their centres on the ground: at most 1 m, or half of the object's
/// diagonal where that is more.
struct TrackingScore {
    int moving_objects = 0;
    int object_frames = 0;
    double mota = 0.0;
    double idf1 = 0.0;
    double recall = 0.0;
    double false_tracks_per_frame = 0.0;  ///< a track on an object at rest, or hardly visible, is none
    int id_switches = 0;
    int never_found = 0;
    /// Frames from an object's first such frame, start-up included, to its first match; to the end if never found.
    std::optional<double> delay_frames_median;
    std::optional<double> delay_frames_p90;
    double centre_error_m = 0.0;
    /// Of matched tracks, against the objects' speed along their way over a second; heading only above 0.5 m/s.
    std::optional<double> velocity_error_mps;
    std::optional<double> heading_error_deg;
    std::vector<MotionErrorRow> motion_errors;  ///< the same over the objects' speed; not visited

    template <class V>
    void visit(V& v) const {
        v("moving_objects", moving_objects);
        v("object_frames", object_frames);
        v("mota", mota);
        v("idf1", idf1);
        v("recall", recall);
        v("false_tracks_per_frame", false_tracks_per_frame);
        v("id_switches", id_switches);
        v("never_found", never_found);
        v("delay_frames_median", delay_frames_median);
        v("delay_frames_p90", delay_frames_p90);
        v("centre_error_m", centre_error_m);
        v("velocity_error_mps", velocity_error_mps);
        v("heading_error_deg", heading_error_deg);
    }
};

/// @param T_true_run  from the run's world to the true one
/// @param range_m     objects and tracks farther from the sensor, on the ground, are left out
/// @param skip        frames of start-up, which count for the delay only
TrackingScore score_tracking(const Truth& truth, const RunOutput& run, const Eigen::Isometry3d& T_true_run,
                             double range_m, int skip);

}  // namespace dlod::tools
