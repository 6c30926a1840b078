// How far the run's poses are from the truth.
#pragma once

#include <optional>
#include <vector>

#include "tools/eval/pose_series.hpp"
#include "tools/eval/truth.hpp"

namespace dlod::tools {

struct PoseError {
    double stamp_s = 0.0;
    double position_m = 0.0;    ///< after the alignment of the ATE
    double rotation_deg = 0.0;  ///< likewise
};

struct TrajectoryScore {
    int poses = 0;  ///< of the run that lie within the drive
    int truth_poses = 0;
    double path_m = 0.0;            ///< true length
    double ate_m = 0.0;             ///< absolute trajectory error: RMSE of position after rigid alignment
    std::optional<double> rpe1s_m;  ///< relative pose error over 1 s, RMSE; nothing when the run is shorter
    std::optional<double> rpe1s_deg;
    std::optional<double>
        drift_pct;               ///< error of the end, seen from the first pose, per path; nothing below 1 m of path
    double worst_m = 0.0;        ///< largest error of a pose, seen from the first one
    double worst_deg = 0.0;      ///< likewise
    double longest_gap_s = 0.0;  ///< between two poses that follow each other
    std::optional<double> valid_pct;  ///< frames of the run that have a pose; nothing where its frames are not known

    std::vector<PoseError> errors;  ///< by pose
    /// From the run's world to the true one: by position for the trajectory, by rotation (well posed on straight paths
    /// too) for tracks and map.
    Eigen::Isometry3d T_true_run = Eigen::Isometry3d::Identity();
    Eigen::Isometry3d T_true_run_by_rotation = Eigen::Isometry3d::Identity();

    template <class V>
    void visit(V& v) const {
        v("poses", poses);
        v("truth_poses", truth_poses);
        v("path_m", path_m);
        v("ate_m", ate_m);
        v("rpe1s_m", rpe1s_m);
        v("rpe1s_deg", rpe1s_deg);
        v("drift_pct", drift_pct);
        v("worst_m", worst_m);
        v("worst_deg", worst_deg);
        v("longest_gap_s", longest_gap_s);
        v("valid_pct", valid_pct);
    }
};

/// Throws std::runtime_error when no pose of the run lies within the drive.
TrajectoryScore score_trajectory(const Truth& truth, const PoseSeries& run);

}  // namespace dlod::tools
