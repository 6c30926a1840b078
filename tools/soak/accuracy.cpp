#include "tools/soak/accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tools/eval/trajectory_score.hpp"

namespace dlod::tools::soak {

Accuracy::Accuracy(const Truth& truth, double lap_s, int laps)
    : truth_(truth), first_lap_end_s_(truth.sensor.front().stamp_s + lap_s) {
    truth_.sensor.reserve(static_cast<std::size_t>(laps) * truth.sensor.size());
    for (int lap = 1; lap < laps; ++lap) {
        for (auto pose : truth.sensor) {
            pose.stamp_s += lap * lap_s;
            truth_.sensor.push_back(pose);
        }
    }
}

PoseErrors Accuracy::judge(const PoseSeries& poses) {
    if (poses.empty()) return {};
    if (!T_truth_run_) {
        PoseSeries first_lap;
        std::copy_if(poses.begin(), poses.end(), std::back_inserter(first_lap),
                     [this](const StampedPose& pose) { return pose.stamp_s < first_lap_end_s_; });
        T_truth_run_ = score_trajectory(truth_, first_lap.empty() ? poses : first_lap).T_true_run;
    }
    PoseErrors errors;
    errors.motion_m = score_trajectory(truth_, poses).rpe1s_m.value_or(0.0);
    double squared_m2 = 0.0;
    for (const auto& pose : poses) {
        const Eigen::Vector3d position_m = *T_truth_run_ * pose.T_world_sensor.translation();
        const double error_m = (position_m - interpolate(truth_.sensor, pose.stamp_s).translation()).norm();
        squared_m2 += error_m * error_m;
        errors.worst_position_m = std::max(errors.worst_position_m, error_m);
    }
    errors.position_m = std::sqrt(squared_m2 / static_cast<double>(poses.size()));
    return errors;
}

}  // namespace dlod::tools::soak
