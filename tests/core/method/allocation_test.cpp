// In the steady state a frame of the whole method takes nothing from the heap.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>

#include "core/dynamic_lidar_odometry.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod::test {
namespace {

/// To and fro, so that after a while everything has been seen.
Eigen::Isometry3d to_and_fro(double time_s) {
    const double t = after_rest(time_s);
    return make_pose(so3_exp({0.0, 0.0, 0.1 * std::sin(1.5 * t)}), {0.2 * std::sin(2.0 * t), 0.0, 0.0});
}

struct SensorSize {
    int height, width, warm, frames;
    friend std::ostream& operator<<(std::ostream& out, const SensorSize& size) {
        return out << size.height << "x" << size.width;
    }
};

class AllocationBySize : public testing::TestWithParam<SensorSize> {};

TEST_P(AllocationBySize, AFrameOfTheWholeMethodTakesNothingInTheSteadyState) {
    const auto [height, width, warm, frames] = GetParam();
    std::vector<SceneBox> scene = furnished_room();
    scene.push_back({{4.2, -3.0, -1}, {4.7, -2.5, 0.75}, false, {0.0, 0.8, 0}});
    DriveOptions options;
    options.height = height;
    options.width = width;
    SimulatedDrive drive(scene, to_and_fro, options);
    Frame frame(drive.sensor());
    DynamicLidarOdometry method(drive.sensor(), MethodConfig{});
    int dynamic = 0;
    for (int k = 0; k < frames; ++k) {
        drive.fill(k, frame);
        const std::size_t before = allocation_count();
        method.process(frame);
        const std::size_t during = allocation_count() - before;
        ASSERT_TRUE(frame.odometry.valid) << k;
        if (k < warm) continue;
        dynamic += frame.detection.dynamic_points > 0 ? 1 : 0;
        EXPECT_EQ(during, 0U) << k;
    }
    EXPECT_GT(dynamic, (frames - warm) / 2);
}

INSTANTIATE_TEST_SUITE_P(Method, AllocationBySize,
                         testing::Values(SensorSize{32, 512, 60, 100}, SensorSize{128, 2048, 36, 46}));

}  // namespace
}  // namespace dlod::test
