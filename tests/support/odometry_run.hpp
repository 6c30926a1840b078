// The odometry over a simulated drive, with the feedback that removal would give.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/map/keyframe_cloud.hpp"
#include "core/odometry/odometry.hpp"
#include "core/preprocess/subsampling.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod::test {

struct RunFrame {
    bool valid = false;
    std::uint32_t flags = 0;
    Eigen::Isometry3d estimate = Eigen::Isometry3d::Identity();  ///< T_world_sensor of the odometry
    Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();     ///< T_world_sensor of the drive
    Matrix6d covariance = Matrix6d::Zero();
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
    Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();
};

class OdometryRun {
  public:
    OdometryRun(SimulatedDrive& drive, const OdometryConfig& config)
        : drive_(drive),
          frame_(drive.sensor()),
          subsampling_(drive.sensor(), SubsamplingConfig{}),
          odometry_(drive.sensor(), config) {}

    /// Frame k; frames may be left out.
    const RunFrame& step(int k) {
        drive_.fill(k, frame_);
        subsampling_.process(frame_);
        OdometryFeedback& feedback = feedback_[count_ % kFeedbackDelay];
        odometry_.process(frame_, count_ >= kFeedbackDelay ? &feedback : nullptr);
        feedback.sequence = frame_.header.sequence;
        feedback.stamp_ns = frame_.header.stamp_ns;
        feedback.has_keyframe = frame_.odometry.keyframe;
        if (feedback.has_keyframe)
            build_keyframe_cloud(
                frame_, [&](PixelIndex pixel) { return drive_.is_moving(pixel); }, feedback.keyframe);
        ++count_;
        const double stamp = drive_.last_stamp_s();
        const OdometryResult& o = frame_.odometry;
        return frames.emplace_back(RunFrame{o.valid, o.flags, o.T_world_sensor, drive_.pose(stamp), o.covariance,
                                            o.imu.gravity_mps2, o.linear_velocity_mps});
    }
    void run(int first, int last) {
        for (int k = first; k < last; ++k) step(k);
    }
    const Frame& frame() const { return frame_; }

    /// Distance between true and estimated position relative to the first valid pose, metres.
    double position_error(std::size_t i) const { return relative_error(first_valid(), i).translation().norm(); }
    std::size_t first_valid() const {
        std::size_t first = 0;
        while (first < frames.size() && !frames[first].valid) ++first;
        return first < frames.size() ? first : 0;
    }
    /// Angle between the true vertical and the world's of a frame's pose, rad.
    double tilt(std::size_t i) const {
        const auto up = [](const Eigen::Isometry3d& T) {
            return (T.rotation().transpose() * Eigen::Vector3d::UnitZ());
        };
        return std::acos(std::min(1.0, up(frames[i].truth).dot(up(frames[i].estimate))));
    }
    double largest_position_error(std::size_t first = 0) const {
        double largest = 0.0;
        for (std::size_t i = first; i < frames.size(); ++i) {
            if (frames[i].valid) largest = std::max(largest, position_error(i));
        }
        return largest;
    }
    /// True motion from frame a to frame b against the estimated one.
    Eigen::Isometry3d relative_error(std::size_t a, std::size_t b) const {
        return (frames[a].truth.inverse() * frames[b].truth).inverse() *
               (frames[a].estimate.inverse() * frames[b].estimate);
    }
    bool any(std::uint32_t flag, std::size_t first = 0) const {
        for (std::size_t i = first; i < frames.size(); ++i) {
            if (frames[i].flags & flag) return true;
        }
        return false;
    }

    std::vector<RunFrame> frames;

  private:
    SimulatedDrive& drive_;
    Frame frame_;
    Subsampling subsampling_;
    Odometry odometry_;
    std::array<OdometryFeedback, kFeedbackDelay> feedback_;
    std::size_t count_ = 0;
};

}  // namespace dlod::test
