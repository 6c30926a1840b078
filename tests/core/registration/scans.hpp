// Scans of known worlds from known poses, and a plain Gauss-Newton loop around the registration's matching.
#pragma once

#include <numbers>

#include "core/preprocess/subsampling.hpp"
#include "core/registration/normal_equations.hpp"
#include "core/registration/placed_points.hpp"
#include "tests/core/registration/sweeps.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod::test {

/// Ground with houses, trees and a wall, 60 m across.
inline std::vector<SceneBox> open_place() {
    return {{{-60, -60, -3}, {60, 60, -1.5}}, {{10, 8, -2}, {25, 20, 6}},      {{-30, 12, -2}, {-12, 25, 8}},
            {{-22, -24, -2}, {-8, -14, 5}},   {{14, -28, -2}, {30, -16, 4}},   {{6, -4, -2}, {6.4, -3.6, 3}},
            {{-5, 6, -2}, {-4.6, 6.4, 3}},    {{-9, -3, -2}, {-8.5, -2.5, 3}}, {{12, 2, -2}, {12.3, 6, 0.5}},
            {{2, -11, -2}, {9, -10.7, 0.5}}};
}

/// What one scan, taken at rest, gives to the registration.
struct Scan {
    Eigen::Isometry3d T_world_sensor;
    PointSelection points;
    std::vector<std::uint8_t> excluded;  ///< zeros

    std::vector<Eigen::Vector3f> positions() const {
        std::vector<Eigen::Vector3f> result;
        for (std::size_t i = 0; i < points.size(); ++i) result.emplace_back(points.x[i], points.y[i], points.z[i]);
        return result;
    }
};

inline Scan take_scan(const std::vector<SceneBox>& scene, const Eigen::Isometry3d& T_world_sensor, std::uint64_t seed) {
    DriveOptions options;
    options.height = 128;
    options.width = 1024;
    options.seed = seed;
    SimulatedDrive drive(
        scene, [&](double) { return T_world_sensor; }, options);
    Frame frame(drive.sensor());
    drive.fill(0, frame);
    Subsampling(drive.sensor(), SubsamplingConfig{}).process(frame);
    Scan scan{T_world_sensor, frame.prepared.points, {}};
    scan.excluded.assign(scan.points.size(), 0);
    return scan;
}

/// Pose of the sensor in the local frame, from matches that `match(i, placed, matches)` finds for a guess.
template <class Match>
Eigen::Isometry3d register_scan(const Scan& scan, Eigen::Isometry3d T_local_sensor, int iterations, Match&& match) {
    PlacedPoints placed;
    PlaneMatches matches;
    NormalEquations equations;
    for (int i = 0; i < iterations; ++i) {
        place(scan.points, at_rest(T_local_sensor), placed);
        match(i, placed, matches);
        accumulate(matches, equations);
        const Vector6d step = -equations.A[0].ldlt().solve(equations.b[0]);
        T_local_sensor.translation() += step.head<3>();
        T_local_sensor.linear() = so3_exp(step.tail<3>()).toRotationMatrix() * T_local_sensor.linear();
    }
    return T_local_sensor;
}

struct PoseError {
    double translation_m, rotation_deg;
};

inline PoseError error_of(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth) {
    const Eigen::Isometry3d off = truth.inverse() * estimate;
    return {off.translation().norm(), so3_log(Eigen::Quaterniond(off.rotation())).norm() * 180.0 / std::numbers::pi};
}

struct Motion {
    const char* name;
    bool indoors;
    Eigen::Vector3d translation_m, rotation_rad;

    Eigen::Isometry3d pose() const { return make_pose(so3_exp(rotation_rad), translation_m); }
    std::vector<SceneBox> scene() const { return indoors ? furnished_room() : open_place(); }
};

inline const Motion kMotions[] = {
    {"StandingIndoors", true, {0, 0, 0}, {0, 0, 0}},
    {"WalkingIndoors", true, {0.15, 0.02, 0.01}, {0.005, -0.01, 0.03}},
    {"TurningIndoors", true, {0.02, 0.03, 0}, {0, 0.01, 0.12}},
    {"WalkingOutdoors", false, {0.15, 0.02, 0.01}, {0.005, -0.01, 0.03}},
    {"DrivingOutdoors", false, {0.3, 0.05, 0.0}, {0.0, 0.02, 0.02}},
};

/// Where the first scan is taken.
inline Eigen::Isometry3d first_pose() {
    return make_pose(so3_exp(Eigen::Vector3d(0.02, -0.03, 0.6)), Eigen::Vector3d(0.5, 0.3, 0.1));
}

}  // namespace dlod::test
