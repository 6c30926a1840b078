// The truth folder of a drive.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/eval/pose_series.hpp"

namespace dlod::tools {

/// Label of a pixel in the truth's labels.bin.
enum class TruthLabel : std::uint8_t { kNoReturn = 0, kStatic = 1, kMoving = 2, kAtRest = 3, kGround = 4 };

/// An object that can move, at a frame's last column, world frame.
struct TruthObject {
    int id = 0;
    Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
    double yaw_rad = 0.0;
    double length_m = 0.0;
    double width_m = 0.0;
    double speed_mps = 0.0;
    int visible_points = 0;
    bool ever_moves = false;
};

struct Truth {
    std::filesystem::path folder;
    PoseSeries last_columns;            ///< sensor pose at each frame's last column
    std::vector<double> first_stamp_s;  ///< of each frame's first column
    PoseSeries sensor;                  ///< poses of first, middle and last columns together, sorted by time
    std::vector<std::vector<TruthObject>> objects;  ///< by frame; empty where the folder has no objects.csv

    /// Throws std::runtime_error naming the file that is missing or malformed.
    explicit Truth(const std::filesystem::path& folder);

    std::size_t frames() const { return last_columns.size(); }

    /// The frame whose sweep, first to last column, holds the time.
    std::optional<std::size_t> frame_at(double stamp_s) const;
};

}  // namespace dlod::tools
