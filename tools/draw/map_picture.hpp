// The run from above.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "tools/eval/evaluation.hpp"
#include "tools/eval/point_files.hpp"
#include "tools/eval/run_output.hpp"

namespace dlod::tools {

/// The true paths, and where their world lies.
struct TruePaths {
    const Truth& truth;
    Eigen::Isometry3d T_run_true;
};

/// Map (darker is higher), trajectory, paths and last boxes of the tracks that were dynamic; with `paths` also the true
/// trajectory and the true paths of what moved.
cv::Mat draw_from_above(const RunOutput& run, const PointList& map, const std::optional<TruePaths>& paths,
                        const std::string& title);

}  // namespace dlod::tools
