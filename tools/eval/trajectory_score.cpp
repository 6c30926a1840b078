#include "tools/eval/trajectory_score.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>

#include "core/types/lie.hpp"

namespace dlod::tools {
namespace {

constexpr double kStampTolerance_s = 1e-3;
constexpr double kMatchTolerance_s = 0.03;
constexpr double kShortPath_m = 0.5;    // positions closer together than this cannot fix a rotation
constexpr double kStraightLine = 1e-3;  // ratio of singular values below which a path is a line
constexpr double kShortestForDrift_m = 1.0;

struct MatchedPose {
    double stamp_s;
    Eigen::Isometry3d run, truth;
};

Eigen::Vector3d mean_position(const std::vector<MatchedPose>& poses, Eigen::Isometry3d MatchedPose::*which) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& pose : poses) sum += (pose.*which).translation();
    return sum / static_cast<double>(poses.size());
}

/// The proper rotation nearest to `m`.
Eigen::Matrix3d nearest_rotation(const Eigen::JacobiSVD<Eigen::Matrix3d>& svd) {
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
    return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
}

Eigen::Isometry3d from_rotation(const Eigen::Matrix3d& R, const Eigen::Vector3d& run, const Eigen::Vector3d& truth) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = R;
    T.translation() = truth - R * run;
    return T;
}

/// Umeyama without scale over positions; through the first pose where positions alone do not fix the rotation.
Eigen::Isometry3d align_by_position(const std::vector<MatchedPose>& poses) {
    const Eigen::Vector3d p = mean_position(poses, &MatchedPose::run);
    const Eigen::Vector3d q = mean_position(poses, &MatchedPose::truth);
    const Eigen::Isometry3d by_first_pose = poses.front().truth * poses.front().run.inverse();
    double extent = 0.0;
    Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
    for (const auto& pose : poses) {
        extent = std::max(extent, (pose.truth.translation() - q).norm());
        m += (pose.truth.translation() - q) * (pose.run.translation() - p).transpose();
    }
    if (extent < kShortPath_m) return by_first_pose;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (svd.singularValues()(1) < kStraightLine * svd.singularValues()(0)) return by_first_pose;
    return from_rotation(nearest_rotation(svd), p, q);
}

/// The mean of R_truth R_run^T, then the centres put upon each other.
Eigen::Isometry3d align_by_rotation(const std::vector<MatchedPose>& poses) {
    Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
    for (const auto& pose : poses) m += pose.truth.linear() * pose.run.linear().transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return from_rotation(nearest_rotation(svd), mean_position(poses, &MatchedPose::run),
                         mean_position(poses, &MatchedPose::truth));
}

double angle_deg(const Eigen::Isometry3d& T) {
    return Eigen::AngleAxisd(T.linear()).angle() * 180.0 / std::numbers::pi;
}

/// Index of the pose nearest in time, if it is near enough.
std::optional<std::size_t> pose_at(const std::vector<MatchedPose>& poses, double stamp_s) {
    const auto after = std::lower_bound(poses.begin(), poses.end(), stamp_s,
                                        [](const MatchedPose& pose, double t) { return pose.stamp_s < t; });
    auto nearest = after == poses.end() ? after - 1 : after;
    if (nearest != poses.begin() && std::abs((nearest - 1)->stamp_s - stamp_s) < std::abs(nearest->stamp_s - stamp_s)) {
        --nearest;
    }
    if (std::abs(nearest->stamp_s - stamp_s) >= kMatchTolerance_s) return std::nullopt;
    return static_cast<std::size_t>(nearest - poses.begin());
}

}  // namespace

TrajectoryScore score_trajectory(const Truth& truth, const PoseSeries& run) {
    const double begin = truth.sensor.front().stamp_s;
    const double end = truth.sensor.back().stamp_s;
    std::vector<MatchedPose> poses;
    for (const auto& pose : run) {
        if (pose.stamp_s < begin - kStampTolerance_s || pose.stamp_s > end + kStampTolerance_s) continue;
        poses.push_back({pose.stamp_s, pose.T_world_sensor, interpolate(truth.sensor, pose.stamp_s)});
    }
    if (poses.empty()) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "no pose of the run lies in the drive: its stamps are %.3f..%.3f, the drive is %.3f..%.3f",
                      run.front().stamp_s, run.back().stamp_s, begin, end);
        throw std::runtime_error(text);
    }

    TrajectoryScore score;
    score.poses = static_cast<int>(poses.size());
    score.truth_poses = static_cast<int>(truth.frames());
    score.T_true_run = align_by_position(poses);
    score.T_true_run_by_rotation = align_by_rotation(poses);

    double squared = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const Eigen::Isometry3d aligned = score.T_true_run * poses[i].run;
        const double distance = (aligned.translation() - poses[i].truth.translation()).norm();
        squared += distance * distance;
        score.errors.push_back({poses[i].stamp_s, distance, angle_deg(poses[i].truth.inverse() * aligned)});
        if (i > 0) score.path_m += (poses[i].truth.translation() - poses[i - 1].truth.translation()).norm();
    }
    score.ate_m = std::sqrt(squared / static_cast<double>(poses.size()));

    double squared_m = 0.0;
    double squared_deg = 0.0;
    int pairs = 0;
    for (const auto& from : poses) {
        const auto index = pose_at(poses, from.stamp_s + 1.0);
        if (!index) continue;
        const auto& to = poses[*index];
        const Eigen::Isometry3d error = (from.truth.inverse() * to.truth).inverse() * (from.run.inverse() * to.run);
        squared_m += error.translation().squaredNorm();
        squared_deg += angle_deg(error) * angle_deg(error);
        ++pairs;
    }
    if (pairs > 0) {
        score.rpe1s_m = std::sqrt(squared_m / pairs);
        score.rpe1s_deg = std::sqrt(squared_deg / pairs);
    }
    const Eigen::Isometry3d T_true_first = poses.front().truth * poses.front().run.inverse();
    double last_m = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const Eigen::Isometry3d pose = T_true_first * poses[i].run;
        last_m = (pose.translation() - poses[i].truth.translation()).norm();
        score.worst_m = std::max(score.worst_m, last_m);
        score.worst_deg = std::max(score.worst_deg, angle_deg(poses[i].truth.inverse() * pose));
        if (i > 0) score.longest_gap_s = std::max(score.longest_gap_s, poses[i].stamp_s - poses[i - 1].stamp_s);
    }
    if (score.path_m > kShortestForDrift_m) score.drift_pct = 100.0 * last_m / score.path_m;
    return score;
}

}  // namespace dlod::tools
