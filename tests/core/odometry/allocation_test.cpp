// In the steady state preparation and odometry take nothing from the heap.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/map/keyframe_cloud.hpp"
#include "core/odometry/odometry.hpp"
#include "core/preprocess/subsampling.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod::test {
namespace {

/// To and fro, so that after a while everything has been seen.
Eigen::Isometry3d to_and_fro(double time_s) {
    const double t = after_rest(time_s);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(0.4 * std::sin(2.0 * t), 0.0, 0.0);
    T.linear() = Eigen::AngleAxisd(0.3 * std::sin(1.5 * t), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T;
}

TEST(Allocation, PreparationAndOdometryTakeNothingInTheSteadyState) {
    constexpr int kWarm = 60;
    constexpr int kFrames = 90;
    SimulatedDrive drive(furnished_room(), to_and_fro);
    Frame frame(drive.sensor());
    Subsampling subsampling(drive.sensor(), {});
    Odometry odometry(drive.sensor(), {});
    std::array<OdometryFeedback, kFeedbackDelay> feedback;
    int steady = 0;
    for (int k = 0; k < kFrames; ++k) {
        drive.fill(k, frame);
        OdometryFeedback& slot = feedback[static_cast<std::size_t>(k % kFeedbackDelay)];
        const bool new_keyframe = k >= kFeedbackDelay && slot.has_keyframe;
        const std::size_t before = allocation_count();
        subsampling.process(frame);
        odometry.process(frame, k >= kFeedbackDelay ? &slot : nullptr);
        const std::size_t during = allocation_count() - before;
        ASSERT_TRUE(frame.odometry.valid);
        if (k >= kWarm && !new_keyframe) {
            EXPECT_EQ(during, 0U) << k;
            ++steady;
        }
        slot.sequence = frame.header.sequence;
        slot.stamp_ns = frame.header.stamp_ns;
        slot.has_keyframe = frame.odometry.keyframe;
        if (slot.has_keyframe) {
            build_keyframe_cloud(
                frame, [](PixelIndex) { return false; }, slot.keyframe);
        }
    }
    EXPECT_GT(steady, (kFrames - kWarm) / 2);
}

}  // namespace
}  // namespace dlod::test
