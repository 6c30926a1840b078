#include "tools/eval/pose_series.hpp"

#include <algorithm>
#include <array>
#include <sstream>
#include <stdexcept>

#include "core/types/lie.hpp"
#include "tools/eval/csv_table.hpp"

namespace dlod::tools {

PoseSeries read_tum(const std::filesystem::path& path) {
    std::istringstream in(read_file(path));
    in.imbue(std::locale::classic());
    PoseSeries series;
    for (std::string line; std::getline(in, line);) {
        if (line.empty() || line[0] == '#') continue;
        std::istringstream cells(line);
        cells.imbue(std::locale::classic());
        std::array<double, 8> v{};
        std::size_t count = 0;
        while (count < v.size() && cells >> v[count]) ++count;
        if (count != v.size()) continue;
        series.push_back({v[0], make_pose(Eigen::Quaterniond(v[7], v[4], v[5], v[6]), {v[1], v[2], v[3]})});
    }
    if (series.empty()) throw std::runtime_error(path.string() + ": no poses");
    return series;
}

Eigen::Isometry3d interpolate(const PoseSeries& series, double stamp_s) {
    const auto next = std::upper_bound(series.begin(), series.end(), stamp_s,
                                       [](double t, const StampedPose& pose) { return t < pose.stamp_s; });
    if (next == series.begin()) return series.front().T_world_sensor;
    if (next == series.end()) return series.back().T_world_sensor;
    const auto& a = *(next - 1);
    const auto& b = *next;
    const double s = (stamp_s - a.stamp_s) / (b.stamp_s - a.stamp_s);
    return make_pose(
        Eigen::Quaterniond(a.T_world_sensor.linear()).slerp(s, Eigen::Quaterniond(b.T_world_sensor.linear())),
        (1.0 - s) * a.T_world_sensor.translation() + s * b.T_world_sensor.translation());
}

}  // namespace dlod::tools
