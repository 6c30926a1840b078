// The output folder of a run: poses, frames, labels, instances, tracks and map.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <span>

#include "core/map/global_map.hpp"
#include "daemon/output/output_file.hpp"
#include "daemon/pipeline/pipeline_frame.hpp"

namespace dlod::daemon {

/// Which clock the NAME_ms columns of frames.csv show.
enum class TimingClock { kWall, kCpu };

/// Writes frame after frame; files and columns are those of the README's table. Not thread-safe.
class ResultWriter {
  public:
    /// Creates the folder where needed and truncates the files in it. @throws OutputError
    ResultWriter(const std::filesystem::path& folder, TimingClock clock);

    /// One record in each file; the row of frames.csv comes last and includes the time of the others.
    /// @throws OutputError, after which the writer is not to be used
    void write(PipelineFrame& frame);

    /// Writes map.pcd and closes everything. @throws OutputError
    void finish(std::span<const MapPoint> map);

  private:
    void write_pose(const Frame& frame);
    void write_tracks(const Frame& frame);
    void write_row(const PipelineFrame& frame);

    std::filesystem::path folder_;
    TimingClock clock_;
    OutputFile trajectory_;
    OutputFile frames_;
    OutputFile labels_;
    OutputFile instances_;
    OutputFile tracks_;
    fmt::memory_buffer line_;
};

}  // namespace dlod::daemon
