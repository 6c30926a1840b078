#include "tools/eval/truth.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "tools/eval/csv_table.hpp"

namespace dlod::tools {
namespace {

constexpr double kStampTolerance_s = 1e-3;

std::vector<std::vector<TruthObject>> read_objects(const std::filesystem::path& path, std::size_t frames) {
    const CsvTable table(path);
    const auto frame = table.column("frame");
    const auto id = table.column("id");
    const auto cx = table.column("cx");
    const auto cy = table.column("cy");
    const auto cz = table.column("cz");
    const auto yaw = table.column("yaw");
    const auto length = table.column("length");
    const auto width = table.column("width");
    const auto speed = table.column("speed");
    const auto visible = table.column("visible_points");
    const auto moves = table.column("ever_moves");
    std::vector<std::vector<TruthObject>> objects(frames);
    for (std::size_t row = 0; row < table.rows(); ++row) {
        const auto k = static_cast<std::size_t>(table.integer(row, frame));
        if (k >= frames) continue;
        objects[k].push_back({.id = static_cast<int>(table.integer(row, id)),
                              .center_m = {table.number(row, cx), table.number(row, cy), table.number(row, cz)},
                              .yaw_rad = table.number(row, yaw),
                              .length_m = table.number(row, length),
                              .width_m = table.number(row, width),
                              .speed_mps = table.number(row, speed),
                              .visible_points = static_cast<int>(table.integer(row, visible)),
                              .ever_moves = table.integer(row, moves) != 0});
    }
    return objects;
}

}  // namespace

Truth::Truth(const std::filesystem::path& truth_folder)
    : folder(truth_folder), last_columns(read_tum(folder / "poses_tum.txt")), sensor(last_columns) {
    const auto start = folder / "poses_start_tum.txt";
    if (std::filesystem::exists(start)) {
        const PoseSeries first_columns = read_tum(start);
        for (const auto& pose : first_columns) first_stamp_s.push_back(pose.stamp_s);
        if (first_stamp_s.size() != frames()) {
            throw std::runtime_error(start.string() + ": has " + std::to_string(first_stamp_s.size()) +
                                     " poses, poses_tum.txt has " + std::to_string(frames()));
        }
        sensor.insert(sensor.end(), first_columns.begin(), first_columns.end());
    } else {  // sweeps follow one another without a gap
        first_stamp_s.push_back(last_columns.front().stamp_s - 0.1);
        for (std::size_t k = 1; k < frames(); ++k) first_stamp_s.push_back(last_columns[k - 1].stamp_s + 1e-4);
    }
    const auto middle = folder / "poses_mid_tum.txt";
    if (std::filesystem::exists(middle)) {
        const PoseSeries middle_columns = read_tum(middle);
        sensor.insert(sensor.end(), middle_columns.begin(), middle_columns.end());
    }
    const auto by_stamp = [](const auto& a, const auto& b) { return a.stamp_s < b.stamp_s; };
    const auto same_stamp = [](const auto& a, const auto& b) { return a.stamp_s == b.stamp_s; };
    std::stable_sort(sensor.begin(), sensor.end(), by_stamp);
    sensor.erase(std::unique(sensor.begin(), sensor.end(), same_stamp), sensor.end());
    if (std::filesystem::exists(folder / "objects.csv")) objects = read_objects(folder / "objects.csv", frames());
}

std::optional<std::size_t> Truth::frame_at(double stamp_s) const {
    auto last = std::lower_bound(last_columns.begin(), last_columns.end(), stamp_s - kStampTolerance_s,
                                 [](const StampedPose& pose, double t) { return pose.stamp_s < t; });
    if (last == last_columns.end()) --last;
    const auto k = static_cast<std::size_t>(last - last_columns.begin());
    if (stamp_s > last->stamp_s + kStampTolerance_s || stamp_s < first_stamp_s[k] - kStampTolerance_s)
        return std::nullopt;
    return k;
}

}  // namespace dlod::tools
