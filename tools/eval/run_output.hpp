// The output folder of a replay.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "core/types/track.hpp"
#include "tools/eval/pose_series.hpp"
#include "tools/eval/truth.hpp"

namespace dlod::tools {

struct RunFrame {
    std::int64_t seq = 0;
    std::int64_t frame_id = 0;
    std::int64_t stamp_ns = 0;
    double stamp_s() const { return static_cast<double>(stamp_ns) * 1e-9; }
};

struct RunOutput {
    std::filesystem::path folder;
    PoseSeries trajectory;
    std::vector<RunFrame> frames;                       ///< rows of frames.csv
    std::map<std::int64_t, std::vector<Track>> tracks;  ///< by seq; the fields that tracks.csv has
    bool has_tracks = false;

    /// Throws std::runtime_error naming the file that is missing or malformed; tracks.csv may be missing.
    explicit RunOutput(const std::filesystem::path& folder);
};

/// Of a drive during which the sensor's clock was set: takes `by_s` from the stamps of the frames from then on, which
/// are told by their ids, and from those of their poses.
void undo_clock_step(RunOutput& run, const Truth& truth, double by_s);

}  // namespace dlod::tools
