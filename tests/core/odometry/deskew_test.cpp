#include "core/odometry/deskew.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/core/registration/sweeps.hpp"

namespace dlod::test {
namespace {

struct Shape {
    int height, width;
    std::vector<int> shifts;  ///< of the rows, repeated
};

class Shapes : public testing::TestWithParam<Shape> {};

TEST_P(Shapes, EveryPointIsMovedByThePoseOfItsColumn) {
    const Shape& shape = GetParam();
    SensorModel sensor;
    sensor.height = shape.height;
    sensor.width = shape.width;
    for (int r = 0; r < shape.height; ++r) {
        sensor.altitude_rad.push_back(0.0F);
        sensor.azimuth_offset_rad.push_back(0.0F);
        sensor.pixel_shift.push_back(shape.shifts[static_cast<std::size_t>(r) % shape.shifts.size()]);
    }
    Frame frame(sensor);
    constexpr std::int64_t kFirst_ns = 5'000'000'000;
    frame.header.first_stamp_ns = kFirst_ns;
    for (int m = 0; m < shape.width; ++m) {
        const auto column = static_cast<std::size_t>(m);
        frame.columns.valid[column] = m % 11 != 5;
        frame.columns.time_ns[column] = frame.columns.valid[column] ? kFirst_ns + m * 100'000'000LL / shape.width : 0;
        if (frame.columns.valid[column]) frame.header.stamp_ns = frame.columns.time_ns[column];
    }
    std::mt19937_64 random(1);
    std::normal_distribution<float> gauss;
    for (int r = 0; r < shape.height; ++r) {
        for (int c = 0; c < shape.width; ++c) {
            const bool there =
                frame.columns.valid[static_cast<std::size_t>(sensor.measurement_of(r, c))] != 0 && (r + c) % 5 != 0;
            const Eigen::Vector3f p = there ? Eigen::Vector3f(8.0F * gauss(random), 8.0F * gauss(random), gauss(random))
                                            : Eigen::Vector3f::Zero().eval();
            frame.cloud.x(r, c) = p.x();
            frame.cloud.y(r, c) = p.y();
            frame.cloud.z(r, c) = p.z();
            frame.cloud.range_m(r, c) = p.norm();
        }
    }
    for (auto* image : {&frame.odometry.x, &frame.odometry.y, &frame.odometry.z}) image->fill(7.0F);
    const double duration_s = static_cast<double>(frame.header.stamp_ns - kFirst_ns) * 1e-9;
    const SweepMotion motion = sweep_of(fast_and_turning, duration_s);
    deskew(sensor, motion, frame);

    const Eigen::Isometry3d T_stamp_local = fast_and_turning(0.0).inverse();
    for (int r = 0; r < shape.height; ++r) {
        for (int c = 0; c < shape.width; ++c) {
            const auto m = static_cast<std::size_t>(sensor.measurement_of(r, c));
            const Eigen::Vector3f q(frame.odometry.x(r, c), frame.odometry.y(r, c), frame.odometry.z(r, c));
            if (frame.cloud.range_m(r, c) == 0.0F) {
                ASSERT_EQ(q, Eigen::Vector3f::Zero());
                continue;
            }
            const double time_s = static_cast<double>(frame.columns.time_ns[m] - frame.header.stamp_ns) * 1e-9;
            const Eigen::Vector3f p(frame.cloud.x(r, c), frame.cloud.y(r, c), frame.cloud.z(r, c));
            const Eigen::Isometry3d T = T_stamp_local * interpolated(motion, time_s);
            ASSERT_LT((q.cast<double>() - T * p.cast<double>()).norm(), 5e-5) << r << ' ' << c;
        }
    }
    for (std::size_t m = 0; m < frame.columns.valid.size(); ++m) {
        if (frame.columns.valid[m]) continue;
        for (std::size_t k = 0; k < 12; ++k) EXPECT_EQ(frame.odometry.deskew[k][m], k % 5 == 0 ? 1.0F : 0.0F);
    }
}

INSTANTIATE_TEST_SUITE_P(Deskew, Shapes,
                         testing::Values(Shape{128, 1024, {12, 4, -4, -12}}, Shape{16, 512, {0}},
                                         Shape{32, 2048, {-2049, 4097, 2047, -1}}, Shape{4, 4096, {65, 33, 1, 0}}));

}  // namespace
}  // namespace dlod::test
