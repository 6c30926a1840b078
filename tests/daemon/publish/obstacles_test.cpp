#include "daemon/publish/obstacles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include "daemon/publish/frame_publisher.hpp"
#include "tests/support/recording_bus.hpp"

namespace dlod::daemon {
namespace {

constexpr int kHeight = 64;
constexpr int kWidth = 512;

SensorModel sensor() {
    SensorModel sensor;
    sensor.height = kHeight;
    sensor.width = kWidth;
    sensor.column_window_last = kWidth - 1;
    return sensor;
}

/// A frame whose pixels have no return but for those that place() gives one.
class Scene {
  public:
    Scene() : frame(sensor()) {
        frame.odometry.valid = true;
        frame.detection.label.fill(static_cast<std::uint8_t>(PixelLabel::kNoReturn));
    }
    /// @param p in odom
    void place(const Eigen::Vector3d& p, PixelLabel label, std::uint32_t track = 0) {
        const Eigen::Vector3f q = (frame.odometry.T_world_sensor.inverse() * p).cast<float>();
        frame.odometry.x[next_] = q.x();
        frame.odometry.y[next_] = q.y();
        frame.odometry.z[next_] = q.z();
        frame.cloud.range_m[next_] = q.norm();
        frame.detection.label[next_] = static_cast<std::uint8_t>(label);
        frame.detection.instance[next_] = track;
        ++next_;
    }
    Frame frame;

  private:
    std::size_t next_ = 0;
};

obstacles_t extract(const Frame& frame, const ObstaclesConfig& config, const Eigen::Vector3d& base,
                    std::size_t most = 5000) {
    obstacles_t message;
    Obstacles(sensor(), config, most).extract(frame, base, message);
    return message;
}

Eigen::Vector3d point(const obstacles_t& m, std::size_t i) {
    return Eigen::Vector3d::Map(m.origin) + m.unit * Eigen::Vector3d(m.x[i], m.y[i], m.z[i]);
}

TEST(Obstacles, ArePointsOffTheGroundAroundTheBaseInOdom) {
    Scene scene;
    scene.frame.header.sequence = 9;
    scene.frame.odometry.T_world_sensor =
        make_pose(so3_exp(Eigen::Vector3d(0.05, 0.0, 1.0)), Eigen::Vector3d(100.0, -50.0, 1.5));
    const Eigen::Vector3d base(100.0, -50.0, 0.5);
    scene.place(base + Eigen::Vector3d(3.0, 0.0, 0.3), PixelLabel::kStatic);
    scene.place(base + Eigen::Vector3d(0.0, 1.0, 0.2), PixelLabel::kDynamic, 17);
    scene.place(base + Eigen::Vector3d(0.0, -2.0, 0.2), PixelLabel::kUndecided, 18);
    scene.place(base + Eigen::Vector3d(1.0, 1.0, -0.5), PixelLabel::kGround);
    scene.place(base + Eigen::Vector3d(1.0, 0.0, 2.2), PixelLabel::kStatic);   // above
    scene.place(base + Eigen::Vector3d(1.0, 0.0, -2.2), PixelLabel::kStatic);  // below
    scene.place(base + Eigen::Vector3d(11.0, 0.0, 0.0), PixelLabel::kStatic);  // beyond
    const auto m = extract(scene.frame, {}, base);
    EXPECT_EQ(m.sequence, 9);
    EXPECT_EQ(m.left_out, 0);
    EXPECT_DOUBLE_EQ(m.radius, 10.0);
    EXPECT_DOUBLE_EQ(m.voxel, 0.2);
    ASSERT_EQ(m.count, 3);
    EXPECT_LT((point(m, 0) - base - Eigen::Vector3d(0.0, 1.0, 0.2)).norm(), 0.01) << "the nearest first";
    EXPECT_LT((point(m, 1) - base - Eigen::Vector3d(0.0, -2.0, 0.2)).norm(), 0.01);
    EXPECT_LT((point(m, 2) - base - Eigen::Vector3d(3.0, 0.0, 0.3)).norm(), 0.01);
    EXPECT_EQ(m.flags, (std::vector<std::int8_t>{obstacles_t::DYNAMIC, obstacles_t::UNDECIDED, 0}));
    EXPECT_EQ(m.track, (std::vector<std::int32_t>{17, 18, 0}));
}

TEST(Obstacles, OneAVoxelAndAMovingOneBeforeOthers) {
    Scene scene;
    const Eigen::Vector3d corner(2.0, -3.0, 0.4);  // of a voxel of 0.2 m
    for (const double offset : {0.02, 0.06, 0.1, 0.14}) {
        scene.place(corner + Eigen::Vector3d::Constant(offset),
                    offset == 0.1 ? PixelLabel::kDynamic : PixelLabel::kStatic, offset == 0.1 ? 5 : 0);
    }
    scene.place(corner + Eigen::Vector3d(0.25, 0.1, 0.1), PixelLabel::kStatic);
    const auto m = extract(scene.frame, {}, Eigen::Vector3d::Zero());
    ASSERT_EQ(m.count, 2);
    const std::size_t moving = m.flags[0] == obstacles_t::DYNAMIC ? 0 : 1;
    EXPECT_EQ(m.flags[moving], obstacles_t::DYNAMIC);
    EXPECT_EQ(m.track[moving], 5);
    EXPECT_LT((point(m, moving) - corner - Eigen::Vector3d::Constant(0.1)).norm(), 0.01);
}

TEST(Obstacles, WhatDoesNotFitIsLeftOutFromTheFarEnd) {
    Scene scene;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> around(-9.0, 9.0);
    for (int i = 0; i < 20'000; ++i) {
        scene.place({around(random), around(random), 0.1 * around(random)}, PixelLabel::kStatic);
    }
    const auto all = extract(scene.frame, {}, Eigen::Vector3d::Zero(), 30'000);
    ASSERT_GT(all.count, 5000);
    EXPECT_EQ(all.left_out, 0);
    std::set<std::tuple<int, int, int>> voxels;
    for (std::size_t i = 0; i < static_cast<std::size_t>(all.count); ++i) {
        // Points are rounded to centimetres: those at a voxel's rim may end up beyond it.
        const Eigen::Vector3d v = point(all, i) / 0.2;
        const Eigen::Vector3d rim = (v - v.array().round().matrix()).cwiseAbs();
        if (rim.minCoeff() < 0.03) continue;
        EXPECT_TRUE(voxels
                        .insert({static_cast<int>(std::floor(v.x())), static_cast<int>(std::floor(v.y())),
                                 static_cast<int>(std::floor(v.z()))})
                        .second)
            << "two in one voxel";
    }
    const auto some = extract(scene.frame, {}, Eigen::Vector3d::Zero(), 1000);
    EXPECT_EQ(some.count, 1000);
    EXPECT_EQ(some.left_out, all.count - 1000);
    EXPECT_LT(some.radius, 9.0);
    for (std::size_t i = 0; i < 1000; ++i) {
        EXPECT_EQ(some.x[i], all.x[i]);
        EXPECT_LE(point(some, i).head<2>().norm(), some.radius + 0.02);
    }
    EXPECT_GE(point(all, 1000).head<2>().norm(), some.radius - 0.02);
}

TEST(Obstacles, DependOnNothingButTheFrame) {
    Scene scene;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> around(-9.0, 9.0);
    for (int i = 0; i < 3000; ++i) scene.place({around(random), around(random), 0.5}, PixelLabel::kStatic);
    Obstacles obstacles(sensor(), {}, 5000);
    obstacles_t first;
    obstacles.extract(scene.frame, Eigen::Vector3d::Zero(), first);
    obstacles_t other;
    obstacles.extract(Scene().frame, Eigen::Vector3d::Zero(), other);
    EXPECT_EQ(other.count, 0);
    obstacles_t again;
    obstacles.extract(scene.frame, Eigen::Vector3d::Zero(), again);
    EXPECT_EQ(first.x, again.x);
    EXPECT_EQ(first.y, again.y);
    EXPECT_EQ(first.z, again.z);
}

TEST(Obstacles, ArePublishedAtTheirRateAndFitIntoADatagram) {
    Scene scene;
    std::mt19937 random(4);
    std::uniform_real_distribution<double> around(-9.0, 9.0);
    for (int i = 0; i < kHeight * kWidth; ++i) {
        scene.place({around(random), around(random), 0.2 * around(random)}, PixelLabel::kStatic);
    }
    test::RecordingBus bus;
    LcmConfig config;
    config.obstacles.every_frames = 3;
    FramePublisher publisher(bus, sensor(), Eigen::Isometry3d::Identity(), config);
    for (const std::uint64_t sequence : {0U, 1U, 2U, 3U, 5U, 6U, 7U, 20U}) {  // some were dropped
        scene.frame.header.sequence = sequence;
        publisher.publish(scene.frame, static_cast<std::int64_t>(sequence));
    }
    scene.frame.header.sequence = 30;
    scene.frame.odometry.valid = false;
    publisher.publish(scene.frame, 30);
    std::vector<std::int64_t> sent;
    for (const auto& m : bus.decoded<obstacles_t>("DLOD_OBSTACLES")) {
        EXPECT_EQ(m.utime, m.sequence);
        EXPECT_GT(m.count, 5500) << "as much as fits";
        EXPECT_GT(m.left_out, 0);
        sent.push_back(m.sequence);
    }
    EXPECT_EQ(sent, (std::vector<std::int64_t>{0, 3, 6, 20}));
    EXPECT_EQ(publisher.failed(), 0U);
}

}  // namespace
}  // namespace dlod::daemon
