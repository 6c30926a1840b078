// All scores of one run against one truth folder.
#pragma once

#include <optional>
#include <string>

#include "tools/eval/map_score.hpp"
#include "tools/eval/mask_score.hpp"
#include "tools/eval/tracking_score.hpp"
#include "tools/eval/trajectory_score.hpp"

namespace dlod::tools {

struct EvaluationOptions {
    double range_m = 25.0;      ///< of tracks; masks are scored within the range that near.bin was made for
    double far_range_m = 50.0;  ///< of tracks, scored once more
    double clock_step_s = 0.0;  ///< by which the sensor's clock was set during the drive
    int skip = 10;              ///< frames of start-up left out of mask and track scores
};

struct Evaluation {
    TrajectoryScore trajectory;
    std::optional<MaskScore> masks;           ///< where the run has labels.bin
    std::optional<TrackingScore> tracks;      ///< where the run has tracks.csv and the truth objects.csv
    std::optional<TrackingScore> tracks_far;  ///< likewise, out to the far range
    std::optional<MapScore> map;              ///< where the run has map.pcd and the truth the map's points
};

/// Throws std::runtime_error naming the file that is missing or malformed.
Evaluation evaluate(const Truth& truth, RunOutput run, const EvaluationOptions& options);

std::string to_json(const Evaluation& evaluation);
/// One line a score: `trajectory: poses=100  ...`, and one for each row of the table of the tracks' motion errors.
std::string to_text(const Evaluation& evaluation);

}  // namespace dlod::tools
