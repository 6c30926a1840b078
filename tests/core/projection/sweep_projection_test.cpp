#include "core/projection/sweep_projection.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/types/lie.hpp"
#include "tests/support/synthetic_frame.hpp"

namespace dlod {
namespace {

/// Fires each pixel from where the sensor is at that time, and asks where the point that it hits appears.
TEST(SweepProjection, FindsThePixelThatLookedAtAPointToWithinOne) {
    const SensorModel sensor = test::small_sensor();
    Frame frame(sensor);
    OdometryResult& odometry = frame.odometry;
    odometry.T_world_sensor = make_pose(so3_exp({0.02, -0.03, 2.0}), {100.0, -50.0, 3.0});
    const auto T_stamp_column = [&](int m) {
        const double t = static_cast<double>(m - sensor.width + 1) / sensor.width;  // -1..0 of a sweep
        return make_pose(so3_exp(t * Eigen::Vector3d(0.0, 0.02, 0.3)), t * Eigen::Vector3d(0.3, 0.05, 0.0));
    };
    for (int m = 0; m < sensor.width; ++m) {
        const Eigen::Isometry3d T = T_stamp_column(m);
        for (int i = 0; i < 12; ++i)
            odometry.deskew[i][static_cast<std::size_t>(m)] = static_cast<float>(T.matrix()(i / 4, i % 4));
    }
    SweepProjection projection(sensor);
    projection.set(odometry);
    int near = 0, all = 0;
    for (int r = 2; r < sensor.height - 2; r += 3) {
        for (int c = 0; c < sensor.width; c += 5) {
            const double azimuth = 2.0 * 3.14159265358979 * (1.0 - static_cast<double>(c) / sensor.width);
            const double elevation = sensor.altitude_rad[static_cast<std::size_t>(r)];
            const Eigen::Vector3d beam(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                       std::sin(elevation));
            const Eigen::Vector3d world =
                odometry.T_world_sensor * (T_stamp_column(sensor.measurement_of(r, c)) * (8.0 * beam));
            const auto seen = projection.project(world);
            ++all;
            if (!seen) continue;
            EXPECT_NEAR(seen->range_m, 8.0, 0.02);
            const int dc = std::abs(seen->pixel.column - c);
            near += std::abs(seen->pixel.row - r) <= 1 && std::min(dc, sensor.width - dc) <= 1;
        }
    }
    // At the seam a place may be seen twice or not at all.
    EXPECT_GT(near, 0.93 * all);
}

}  // namespace
}  // namespace dlod
