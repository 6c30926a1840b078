#pragma once

#include "core/map/keyframe_database.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/registration/scan_to_scan.hpp"
#include "core/registration/scan_to_submap.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct OdometryConfig {
    bool use_imu = true;
    double max_deviation_m = 0.3;
    double surface_error_m = 0.002;
    ScanToScanConfig scan_to_scan;
    ScanToSubmapConfig scan_to_submap;
    MotionFilterConfig motion;
    VoxelMapConfig voxels;
    KeyframeConfig keyframes;

    template <class V>
    void visit(V& v) {
        v.flag("use_imu", use_imu, "use the sensor's IMU for rotation, gravity and motion within the sweep");
        v.parameter("max_deviation_m", max_deviation_m, Range{0.01, 100.0}, "m",
                    "a pose is valid while its standard deviation against the local map stays below this in every "
                    "direction; higher trusts predictions for longer, in tunnels and through gaps");
        v.parameter("surface_error_m", surface_error_m, Range{0.0, 0.5}, "m",
                    "error of the map that all points of a voxel's surface share; larger makes the covariance grow "
                    "faster with the way");
        v.group("scan_to_scan", scan_to_scan, "first stage of the registration");
        v.group("scan_to_submap", scan_to_submap, "second stage of the registration");
        v.group("motion", motion, "motion model and its noise");
        v.group("voxels", voxels, "voxels of the local map");
        v.group("keyframes", keyframes, "choice of keyframes and submap");
    }
};

}  // namespace dlod
