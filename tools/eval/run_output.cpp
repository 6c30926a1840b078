#include "tools/eval/run_output.hpp"

#include <cmath>
#include <stdexcept>

#include "tools/eval/csv_table.hpp"

namespace dlod::tools {
namespace {

DynamicState state_from(std::string_view text, const std::filesystem::path& file) {
    if (text == "undefined") return DynamicState::kUndefined;
    if (text == "static") return DynamicState::kStatic;
    if (text == "dynamic") return DynamicState::kDynamic;
    throw std::runtime_error(file.string() + ": unknown state " + std::string(text));
}

std::map<std::int64_t, std::vector<Track>> read_tracks(const std::filesystem::path& path) {
    const CsvTable table(path);
    const auto at = [&](std::size_t row, const char* name) { return table.number(row, table.column(name)); };
    const auto count = [&](std::size_t row, const char* name) {
        return static_cast<int>(table.integer(row, table.column(name)));
    };
    std::map<std::int64_t, std::vector<Track>> tracks;
    for (std::size_t row = 0; row < table.rows(); ++row) {
        Track track;
        track.id = static_cast<std::uint32_t>(table.integer(row, table.column("id")));
        track.state = state_from(table.text(row, table.column("state")), path);
        track.box.center_m = {at(row, "x"), at(row, "y"), at(row, "z")};
        track.box.yaw_rad = at(row, "yaw");
        track.box.size_m = {at(row, "length"), at(row, "width"), at(row, "height")};
        track.velocity_mps = {at(row, "vx"), at(row, "vy"), at(row, "vz")};
        track.points = count(row, "points");
        track.hits = count(row, "hits");
        track.residual_m = at(row, "residual");
        tracks[table.integer(row, table.column("seq"))].push_back(track);
    }
    return tracks;
}

}  // namespace

RunOutput::RunOutput(const std::filesystem::path& run_folder)
    : folder(run_folder), trajectory(read_tum(folder / "trajectory.tum")) {
    const CsvTable table(folder / "frames.csv");
    const auto seq = table.column("seq");
    const auto id = table.column("frame_id");
    const auto stamp = table.column("stamp_ns");
    for (std::size_t row = 0; row < table.rows(); ++row)
        frames.push_back({table.integer(row, seq), table.integer(row, id), table.integer(row, stamp)});
    has_tracks = std::filesystem::exists(folder / "tracks.csv");
    if (has_tracks) tracks = read_tracks(folder / "tracks.csv");
}

void undo_clock_step(RunOutput& run, const Truth& truth, double by_s) {
    constexpr double kNoStep_s = 0.5;      // a frame whose last columns are missing has an earlier stamp, too
    constexpr double kSameStamp_s = 1e-6;  // of a pose and its frame
    auto pose = run.trajectory.begin();
    for (RunFrame& frame : run.frames) {
        const auto turn = static_cast<std::size_t>(frame.frame_id - run.frames.front().frame_id);
        if (turn >= truth.frames()) return;
        const bool has_pose = pose != run.trajectory.end() && std::abs(pose->stamp_s - frame.stamp_s()) < kSameStamp_s;
        if (std::abs(frame.stamp_s() - truth.last_columns[turn].stamp_s) > kNoStep_s) {
            frame.stamp_ns -= std::llround(1e9 * by_s);
            if (has_pose) pose->stamp_s -= by_s;
        }
        if (has_pose) ++pose;
    }
}

}  // namespace dlod::tools
