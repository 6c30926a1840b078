#include "core/odometry/placed_scan.hpp"

#include <gtest/gtest.h>

namespace dlod::test {
namespace {

PointSelection points_ahead(std::size_t flat, std::size_t others) {
    PointSelection points;
    for (std::size_t i = 0; i < flat + others; ++i) {
        points.pixel.push_back(static_cast<PixelIndex>(i));
        points.measurement.push_back(0);
        points.x.push_back(2.0F + static_cast<float>(i));
        points.y.push_back(0.0F);
        points.z.push_back(0.0F);
        points.nx.push_back(i < flat ? -1.0F : 0.0F);
        points.planarity.push_back(i < flat ? 1.0F : 0.0F);
        points.time_s.push_back(-0.05F);
        for (auto* values : {&points.ny, &points.nz, &points.tx, &points.ty, &points.tz}) values->push_back(0.0F);
    }
    return points;
}

/// At 10 m along x, at 4 m/s.
MotionFilter filter_on_its_way() {
    MotionFilter filter(MotionFilterConfig{}, Eigen::Isometry3d::Identity());
    filter.initialize(Eigen::Isometry3d(Eigen::Translation3d(10.0, 0.0, 0.0)), {0.0, 0.0, -9.8}, 1'000'000'000,
                      nullptr);
    filter.set_motion({4.0, 0.0, 0.0}, Eigen::Vector3d::Zero());
    return filter;
}

TEST(PlacedScan, PutsPointsWhereTheyWereSeen) {
    const PointSelection points = points_ahead(3, 2);
    PlacedScan scan;
    scan.begin(points, 1'000'000'000, 0.1);
    scan.choose_origin({10.0, 0.0, 0.0}, 0.4);
    scan.move_all(filter_on_its_way());
    ASSERT_EQ(scan.placed().size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) {
        // Fired half a sweep before the stamp, 0.2 m farther back.
        EXPECT_NEAR(static_cast<double>(scan.placed().x[i]) + scan.origin_m().x(),
                    10.0 - 0.2 + 2.0 + static_cast<double>(i), 1e-4);
    }
    const KeyframeCloud cloud = scan.cloud();
    EXPECT_EQ(cloud.T_world_sensor.translation(), scan.origin_m());
    EXPECT_EQ(cloud.x.size(), 5U);
}

TEST(PlacedScan, TheLocalFrameLiesOnACornerOfAVoxelNearTheSensor) {
    PlacedScan scan, other;
    scan.choose_origin({10.3, -0.1, 0.5}, 0.4);
    EXPECT_EQ(scan.origin().x, 25);
    EXPECT_EQ(scan.origin().y, -1);
    EXPECT_EQ(scan.origin().z, 1);
    EXPECT_LT((scan.origin_m() - Eigen::Vector3d(10.0, -0.4, 0.4)).norm(), 1e-12);
    other.share_origin(scan);
    EXPECT_EQ(other.origin_m(), scan.origin_m());
}

TEST(PlacedScan, CountsWhatMayFindACounterpart) {
    const PointSelection points = points_ahead(4, 2);
    PlacedScan scan;
    scan.begin(points, 1'000'000'000, 0.1);
    scan.move(filter_on_its_way());
    EXPECT_EQ(scan.left_out().size(), 4U);
    EXPECT_EQ(scan.candidates(), 4U);
    EXPECT_EQ(scan.flat_points(), 4U);

    MovingPoints moving;
    MovingBox box;
    box.box.center_m = Eigen::Vector3d(12.8, 0.0, 0.0);
    box.box.size_m = Eigen::Vector3d(0.2, 0.2, 0.2);
    moving.set(std::vector<MovingBox>{box}, scan.stamp_ns());
    scan.leave_out(moving);
    EXPECT_EQ(scan.candidates(), 3U);
    EXPECT_EQ(scan.left_out()[1], 1);
    // Of another scan none is left out yet.
    scan.begin(points, 1'100'000'000, 0.1);
    EXPECT_EQ(scan.candidates(), 4U);
}

}  // namespace
}  // namespace dlod::test
