// The whole method from the first frame on, on a robot that is in motion when it is switched on.
#include <gtest/gtest.h>

#include "core/dynamic_lidar_odometry.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod {
namespace {

class MovingStart : public testing::TestWithParam<bool> {};

// The first frame's scan is published before its motion is known. What stands still must not seem to move for that.
TEST_P(MovingStart, NothingMovesWhereNothingMoves) {
    auto scene = test::furnished_room();
    for (const double y : {-4.0, -2.0, 2.0, 4.0}) {  // rather like parked cars
        scene.push_back({.low = {-3.0, y - 0.4, 0.0}, .high = {-1.2, y + 0.4, 1.2}});
        scene.push_back({.low = {1.0, y - 0.4, 0.0}, .high = {2.8, y + 0.4, 1.2}});
    }
    test::DriveOptions options;
    options.imu = GetParam();
    test::SimulatedDrive drive(
        scene,
        [](double t) { return make_pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(5.0 * t - 6.0, 0.0, 1.2)); },
        options);
    DynamicLidarOdometry method(drive.sensor(), {});
    Frame frame(drive.sensor());
    for (int k = 0; k < 20; ++k) {
        SCOPED_TRACE(k);
        drive.fill(k, frame);
        method.process(frame);
        EXPECT_EQ(frame.odometry.valid, options.imu || k > 0)
            << "without IMU the second scan has to bear out the first";
        EXPECT_EQ(frame.detection.dynamic_points, 0);
        for (const Track& track : frame.detection.tracks) EXPECT_NE(track.state, DynamicState::kDynamic);
    }
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutImu, MovingStart, testing::Bool());

}  // namespace
}  // namespace dlod
