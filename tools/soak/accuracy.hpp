// How far the poses of a drive that is repeated again and again are from the truth.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "tools/eval/pose_series.hpp"
#include "tools/eval/truth.hpp"

namespace dlod::tools::soak {

/// Errors of some poses. Zeros where there are none.
struct PoseErrors {
    double motion_m = 0.0;    ///< root mean square of the motion over one second
    double position_m = 0.0;  ///< root mean square, after the alignment
    double worst_position_m = 0.0;
};

/// The world of the poses is that of the truth but for a rigid transform, which the first lap gives, by the best fit.
/// The first pose alone would not do: its roll and pitch are no better than the accelerometer's bias.
class Accuracy {
  public:
    /// @param truth of one lap, which ends as it began @param lap_s its length @param laps how often it is repeated
    Accuracy(const Truth& truth, double lap_s, int laps);

    /// Errors of these poses, in order of time; those of the first call reach as far into the first lap as possible.
    PoseErrors judge(const PoseSeries& poses);

  private:
    Truth truth_;  ///< of all laps
    double first_lap_end_s_;
    std::optional<Eigen::Isometry3d> T_truth_run_;
};

}  // namespace dlod::tools::soak
