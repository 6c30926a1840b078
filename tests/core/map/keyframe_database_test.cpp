#include "core/map/keyframe_database.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace dlod {
namespace {

/// A patch of floor and a post around a position.
KeyframeCloud cloud_at(const Eigen::Vector3d& position, double yaw = 0.0) {
    KeyframeCloud cloud;
    cloud.T_world_sensor = make_pose(so3_exp({0.0, 0.0, yaw}), position);
    const float up[3] = {0, 0, 1}, none[3] = {0, 0, 0};
    for (int i = -10; i <= 10; ++i) {
        for (int j = -10; j <= 10; ++j) {
            const float p[3] = {0.2F * static_cast<float>(i), 0.2F * static_cast<float>(j), -1.0F};
            cloud.push(p, up);
        }
        const float post[3] = {1.0F, 1.0F, 0.1F * static_cast<float>(i)};
        cloud.push(post, none);
    }
    return cloud;
}

class KeyframeDatabaseTest : public testing::Test {
  protected:
    void add(KeyframeDatabase& database, const Eigen::Vector3d& position) {
        const KeyframeCloud cloud = cloud_at(position);
        database.announce(cloud.T_world_sensor, 1e-4 * Matrix6d::Identity());
        database.add(cloud);
    }
    static std::uint32_t points_at(KeyframeDatabase& database, const Eigen::Vector3d& p) {
        const double side = database.submap().voxel_m();
        const auto index = [&](double v) { return static_cast<std::int32_t>(std::floor(v / side)); };
        const VoxelPlane* plane = database.submap().find({index(p.x()), index(p.y()), index(p.z())});
        return plane != nullptr ? plane->points : 0U;
    }

    KeyframeConfig config;
    VoxelMapConfig voxels;
};

TEST_F(KeyframeDatabaseTest, TheSubmapHoldsTheNearestKeyframes) {
    config.nearest = 3;
    config.convex_hull = config.concave_hull = 0;
    KeyframeDatabase database(config, voxels);
    for (int k = 0; k < 10; ++k) add(database, {10.0 * k, 0.0, 0.0});
    for (const int at : {0, 5, 9, 2}) {
        database.update_submap({10.0 * at, 0.0, 0.0});
        std::set<int> present;
        for (int k = 0; k < 10; ++k) {
            if (points_at(database, {10.0 * k + 0.1, 0.1, -1.0}) > 0) present.insert(k);
        }
        const int first = std::clamp(at - 1, 0, 7);
        EXPECT_EQ(present, (std::set<int>{first, first + 1, first + 2})) << at;
    }
}

TEST_F(KeyframeDatabaseTest, TheRimOfWhatWasVisitedIsInTheSubmapToo) {
    config.nearest = 1;
    config.convex_hull = 4;
    config.concave_hull = 0;
    KeyframeDatabase database(config, voxels);
    const std::vector<Eigen::Vector3d> corners = {{-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0}};
    for (const auto& corner : corners) add(database, corner);
    for (int k = -1; k <= 1; ++k) add(database, {6.0 * k, 1.0, 0.0});
    database.update_submap({0.2, 1.0, 0.0});
    for (const auto& corner : corners) EXPECT_GT(points_at(database, corner + Eigen::Vector3d(0.1, 0.1, -1.0)), 0U);
    EXPECT_GT(points_at(database, {0.1, 1.1, -1.0}), 0U);
    EXPECT_EQ(points_at(database, {6.1, 1.1, -1.0}), 0U);
}

TEST_F(KeyframeDatabaseTest, AKeyframeIsDueByDistanceOrTurn) {
    config.distance_share = 0.1;
    config.min_distance_m = 0.5;
    config.max_distance_m = 4.0;
    config.angle_deg = 30.0;
    KeyframeDatabase database(config, voxels);
    for (int k = 0; k < 5; ++k) {  // the first five are always
        EXPECT_TRUE(database.is_due(Eigen::Isometry3d::Identity(), 10.0));
        add(database, Eigen::Vector3d::Zero());
    }
    const auto due = [&](double x, double yaw, double spaciousness_m) {
        return database.is_due(make_pose(so3_exp({0, 0, yaw}), {x, 0, 0}), spaciousness_m);
    };
    EXPECT_FALSE(due(0.9, 0.0, 10.0));
    EXPECT_TRUE(due(1.1, 0.0, 10.0));
    EXPECT_FALSE(due(0.4, 0.0, 1.0));  // not nearer than the least
    EXPECT_TRUE(due(0.6, 0.0, 1.0));
    EXPECT_FALSE(due(3.9, 0.0, 1000.0));  // not farther than the most
    EXPECT_TRUE(due(4.1, 0.0, 1000.0));
    EXPECT_FALSE(due(0.0, 0.5, 10.0));
    EXPECT_TRUE(due(0.0, 0.55, 10.0));
    // What is on its way counts.
    database.announce(make_pose(so3_exp({0, 0, 0}), {2.0, 0, 0}), Matrix6d::Zero());
    EXPECT_FALSE(due(2.1, 0.0, 10.0));
}

// The reference cleans the map on display only: its odometry keeps on matching against ghosts.
TEST_F(KeyframeDatabaseTest, WhatTurnsDynamicLeavesTheKeyframesAndTheirSubmap) {
    KeyframeDatabase database(config, voxels), clean(config, voxels);
    for (int k = 0; k < 3; ++k) add(database, {0.3 * k, 0.0, 0.0});
    database.update_submap({0, 0, 0});
    OrientedBox box;
    box.center_m = {1.3, 1.0, 0.2};
    box.size_m = {1.03, 0.43, 2.25};
    box.yaw_rad = 0.1;
    ASSERT_GT(points_at(database, {1.3, 1.0, 0.3}), 0U);
    database.remove_points(box);
    EXPECT_EQ(points_at(database, {1.3, 1.0, 0.3}), 0U);
    // Keyframes from which the points have been taken give the same submap whenever they are chosen.
    for (int k = 0; k < 3; ++k) {
        KeyframeCloud cloud = cloud_at({0.3 * k, 0.0, 0.0});
        KeyframeCloud kept;
        kept.T_world_sensor = cloud.T_world_sensor;
        for (std::size_t i = 0; i < cloud.x.size(); ++i) {
            const float p[3] = {cloud.x[i], cloud.y[i], cloud.z[i]}, n[3] = {cloud.nx[i], cloud.ny[i], cloud.nz[i]};
            const Eigen::Vector3d world = cloud.T_world_sensor * Eigen::Vector3f(p[0], p[1], p[2]).cast<double>();
            if (!box.contains(world)) kept.push(p, n);
        }
        clean.add(kept);
    }
    clean.update_submap({0, 0, 0});
    database.update_submap({500, 0, 0});
    database.update_submap({0, 0, 0});
    EXPECT_EQ(database.submap().size(), clean.submap().size());
    for (double x = -2.0; x < 3.0; x += 0.25) {
        for (double y = -2.0; y < 2.0; y += 0.25) {
            for (double z = -1.25; z < 1.5; z += 0.25)
                EXPECT_EQ(points_at(database, {x, y, z}), points_at(clean, {x, y, z}));
        }
    }
}

TEST_F(KeyframeDatabaseTest, MemoryIsBoundedAndTheFarthestIsForgotten) {
    config.max_keyframes = 20;
    KeyframeDatabase database(config, voxels);
    for (int k = 0; k < 200; ++k) {
        add(database, {2.0 * k, 0.0, 0.0});
        EXPECT_LE(database.size(), 20U);
        database.update_submap({2.0 * k, 0.0, 0.0});
        // The submap is bounded with it: at most twenty patches of 9 x 9 voxels, a few layers high.
        EXPECT_LT(database.submap().size(), 20U * 150U);
    }
    database.update_submap({0.0, 0.0, 0.0});
    EXPECT_EQ(points_at(database, {0.1, 0.1, -1.0}), 0U);
    database.update_submap({398.0, 0.0, 0.0});
    EXPECT_GT(points_at(database, {398.1, 0.1, -1.0}), 0U);
    database.clear();
    EXPECT_TRUE(database.empty());
    EXPECT_EQ(database.submap().size(), 0U);
}

TEST_F(KeyframeDatabaseTest, AnnouncedKeyframesThatNeverComeDoNotPileUp) {
    KeyframeDatabase database(config, voxels);
    for (int k = 0; k < 10; ++k) add(database, {0.0, 0.0, 0.0});
    for (int k = 0; k < 1000; ++k) database.announce(make_pose(so3_exp({0, 0, 0}), {3.0 * k, 0, 0}), Matrix6d::Zero());
    EXPECT_FALSE(database.is_due(make_pose(so3_exp({0, 0, 0}), {2997.0, 0, 0}), 10.0));
    EXPECT_TRUE(database.is_due(make_pose(so3_exp({0, 0, 0}), {300.0, 0, 0}), 10.0));
}

TEST_F(KeyframeDatabaseTest, TheProvisionalSubmapGoesWithTheFirstKeyframe) {
    KeyframeDatabase database(config, voxels);
    database.set_provisional(cloud_at({0, 0, 0}));
    EXPECT_FALSE(database.empty());
    const std::uint32_t points = points_at(database, {0.1, 0.1, -1.0});
    EXPECT_GT(points, 0U);
    database.set_provisional(cloud_at({0.0, 0.0, 0.0}));
    EXPECT_EQ(points_at(database, {0.1, 0.1, -1.0}), points);
    add(database, {100.0, 0.0, 0.0});
    database.update_submap({100.0, 0.0, 0.0});
    EXPECT_EQ(points_at(database, {0.1, 0.1, -1.0}), 0U);
    EXPECT_EQ(points_at(database, {100.1, 0.1, -1.0}), points);
}

TEST_F(KeyframeDatabaseTest, TheAnchorsUncertaintyIsTheirsSeenFromAfar) {
    KeyframeDatabase database(config, voxels);
    EXPECT_EQ(database.anchor_covariance({0, 0, 0}).norm(), 0.0);
    const KeyframeCloud cloud = cloud_at({0, 0, 0});
    Matrix6d covariance = Matrix6d::Zero();
    covariance.diagonal() << 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 4e-6;
    database.announce(cloud.T_world_sensor, covariance);
    database.add(cloud);
    database.update_submap({0, 0, 0});
    const Matrix6d here = database.anchor_covariance({0, 0, 0});
    EXPECT_LT((here - covariance).norm(), 1e-12);
    // Ten metres ahead its yaw moves sideways.
    const Matrix6d ahead = database.anchor_covariance({10, 0, 0});
    EXPECT_NEAR(ahead(1, 1), 1e-4 + 100.0 * 4e-6, 1e-9);
    EXPECT_NEAR(ahead(0, 0), 1e-4, 1e-9);
}

TEST_F(KeyframeDatabaseTest, PointsThatAreNoNumbersOrAbsurdlyFarAreLeftOut) {
    KeyframeDatabase database(config, voxels);
    KeyframeCloud cloud = cloud_at({0, 0, 0});
    const std::size_t good = cloud.x.size();
    const float none[3] = {0, 0, 0};
    const float nan[3] = {std::nanf(""), 0, 0}, far[3] = {1e9F, 0, 0}, infinite[3] = {0, INFINITY, 0};
    for (const auto* bad : {&nan, &far, &infinite}) cloud.push(*bad, none);
    database.add(cloud);
    database.update_submap({0, 0, 0});
    std::uint32_t total = 0;
    for (double x = -4.25; x < 4.5; x += 0.5) {
        for (double y = -4.25; y < 4.5; y += 0.5) {
            for (double z = -4.25; z < 4.5; z += 0.5) total += points_at(database, {x, y, z});
        }
    }
    EXPECT_EQ(total, good);
}

}  // namespace
}  // namespace dlod
