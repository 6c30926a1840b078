#include <gtest/gtest.h>

#include <limits>

#include "tests/support/odometry_run.hpp"

namespace dlod::test {
namespace {

/// Fills the results with what another frame might have left there.
void spoil(OdometryResult& result) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    result.valid = result.keyframe = true;
    result.flags = ~0U;
    result.T_world_sensor.matrix().setConstant(nan);
    result.linear_velocity_mps.setConstant(nan);
    result.angular_velocity_radps.setConstant(nan);
    result.covariance.setConstant(nan);
    result.imu.gravity_mps2.setConstant(nan);
    result.iterations = result.correspondences = -1;
    result.residual_pixel.assign(10, 5);
    result.residual_m.assign(10, 1.0F);
    for (auto* image : {&result.x, &result.y, &result.z}) image->fill(3.0F);
}

// Frames come from a pool: which one it is depends on the threads, and what is published must not.
TEST(EmptyFrames, HoldNothingOfTheFrameThatWasThereBefore) {
    SimulatedDrive drive(furnished_room(), [](double time_s) {
        const double t = after_rest(time_s);
        return make_pose(so3_exp({0.0, 0.0, 0.2 * t}), {0.5 * t, 0.0, 0.0});
    });
    drive.column_arrives = [](int k, int) { return k != 0 && k != 9; };
    Frame frame(drive.sensor());
    Subsampling subsampling(drive.sensor(), SubsamplingConfig{});
    Odometry odometry(drive.sensor(), OdometryConfig{});
    Eigen::Isometry3d last = Eigen::Isometry3d::Identity();
    for (int k = 0; k < 10; ++k) {
        drive.fill(k, frame);
        subsampling.process(frame);
        spoil(frame.odometry);
        odometry.process(frame, nullptr);
        const OdometryResult& o = frame.odometry;
        EXPECT_TRUE(o.T_world_sensor.matrix().allFinite() && o.covariance.allFinite() && o.imu.gravity_mps2.allFinite());
        EXPECT_TRUE(o.linear_velocity_mps.allFinite() && o.angular_velocity_radps.allFinite());
        if (k == 0 || k == 9) {
            EXPECT_FALSE(o.valid || o.keyframe);
            EXPECT_EQ(o.flags, static_cast<std::uint32_t>(OdometryResult::kPredictedOnly));
            EXPECT_EQ(o.T_world_sensor.matrix(), last.matrix());
            EXPECT_TRUE(o.residual_pixel.empty() && o.residual_m.empty());
            EXPECT_EQ(o.iterations, 0);
            for (const auto* image : {&o.x, &o.y, &o.z}) {
                for (std::size_t p = 0; p < image->size(); ++p) ASSERT_EQ((*image)[p], 0.0F);
            }
        } else {
            EXPECT_TRUE(o.valid);
            EXPECT_EQ(o.residual_pixel.size(), o.residual_m.size());
        }
        last = o.T_world_sensor;
    }
}

}  // namespace
}  // namespace dlod::test
