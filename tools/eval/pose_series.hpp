// Time-stamped poses as trajectory files hold them.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <vector>

namespace dlod::tools {

struct StampedPose {
    double stamp_s = 0.0;
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
};
using PoseSeries = std::vector<StampedPose>;

/// Reads lines of `t x y z qx qy qz qw`; others and comments (#) are skipped. Throws std::runtime_error naming the file
/// when it has no pose.
PoseSeries read_tum(const std::filesystem::path& path);

/// The pose at `stamp_s`, between its neighbours in the series (sorted by time), held at the ends.
Eigen::Isometry3d interpolate(const PoseSeries& series, double stamp_s);

}  // namespace dlod::tools
