#include "core/evidence/free_space.hpp"

#include <gtest/gtest.h>

#include "core/evidence/evidence_image.hpp"
#include "tests/support/rendered_scene.hpp"

namespace dlod {
namespace {

constexpr double kPeriod_s = 0.1;

/// A sensor whose rows look to different sides and are shifted accordingly.
SensorModel staggered_sensor() {
    SensorModel sensor = test::even_sensor(64, 1024, 0.4, -0.4);
    for (std::size_t r = 0; r < 64; ++r) {
        const double offset_rad = 0.18 - 0.12 * static_cast<double>(r % 4);
        sensor.azimuth_offset_rad[r] = static_cast<float>(offset_rad);
        sensor.pixel_shift[r] = static_cast<int>(std::lround((offset_rad + 0.2) / (2.0 * std::numbers::pi) * 1024));
    }
    return sensor;
}

/// Pose of a robot that drives 2 m/s and turns `yaw_rate`, at time t.
Eigen::Isometry3d pose_at(double t_s, double yaw_rate) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = Eigen::AngleAxisd(yaw_rate * t_s, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    pose.translation() = Eigen::Vector3d(2.0 * t_s, 0.3 * t_s, 1.0);
    return pose;
}

/// Shoots each column at its own time and fills the true deskewing.
void render_sweep(const SensorModel& sensor, const test::Scene& scene, int number, double yaw_rate, Frame& frame) {
    const auto column_time = [&](int m) { return kPeriod_s * (number + static_cast<double>(m + 1) / sensor.width); };
    const Eigen::Isometry3d stamp = pose_at(column_time(sensor.width - 1), yaw_rate);
    frame.header.stamp_ns = static_cast<std::int64_t>(1e9 * column_time(sensor.width - 1));
    frame.odometry.valid = true;
    frame.odometry.T_world_sensor = stamp;
    for (int m = 0; m < sensor.width; ++m) {
        const Eigen::Isometry3d world = pose_at(column_time(m), yaw_rate);
        const Eigen::Isometry3d deskew = stamp.inverse() * world;
        for (int i = 0; i < 12; ++i) {
            frame.odometry.deskew[i][static_cast<std::size_t>(m)] = static_cast<float>(deskew(i / 4, i % 4));
        }
        for (int r = 0; r < sensor.height; ++r) {
            const int c = (m + sensor.pixel_shift[static_cast<std::size_t>(r)]) % sensor.width;
            const Eigen::Vector3d direction = test::beam(sensor, r, c);
            const double range = std::max(0.0, scene(world.translation(), world.linear() * direction));
            const Eigen::Vector3f p = (range * direction).cast<float>();
            const Eigen::Vector3f q = deskew.cast<float>() * p;
            frame.cloud.range_m(r, c) = static_cast<float>(range);
            frame.cloud.x(r, c) = p.x(), frame.cloud.y(r, c) = p.y(), frame.cloud.z(r, c) = p.z();
            frame.odometry.x(r, c) = q.x(), frame.odometry.y(r, c) = q.y(), frame.odometry.z(r, c) = q.z();
        }
    }
}

/// A closed room with pillars: depth edges all around.
double pillars(const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double range = test::plane_range(Eigen::Vector3d::UnitZ(), -0.5, o, d);
    for (const double side : {-1.0, 1.0}) {
        range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitX(), 15.0 * side, o, d));
        range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitY(), 15.0 * side, o, d));
    }
    range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitZ(), 6.0, o, d));
    for (int i = 0; i < 12; ++i) {
        const double a = 2.0 * std::numbers::pi * i / 12.0;
        const Eigen::Vector3d foot(7.0 * std::cos(a), 7.0 * std::sin(a), -0.5);
        range = test::nearest(
            range, test::box_range(foot - Eigen::Vector3d(0.2, 0.2, 0.0), foot + Eigen::Vector3d(0.2, 0.2, 4.0), o, d));
    }
    return range;
}

class Turning : public testing::TestWithParam<double> {};

/// Motion within the sweep, the rows' shifts and the image's seam are all accounted for: nothing static is ever free.
TEST_P(Turning, StaticRoomIsOccupiedWhileTheSensorTurns) {
    const SensorModel sensor = staggered_sensor();
    Frame frame(sensor);
    EvidenceImage evidence(sensor, {});
    long tested = 0;
    long free = 0;
    long occupied = 0;
    for (int k = 0; k < 14; ++k) {
        render_sweep(sensor, pillars, k, GetParam(), frame);
        evidence.begin(frame);
        for (PixelIndex p = 0; p < sensor.pixels(); p += 3) evidence.request(p);
        evidence.run(frame);
        for (const PixelIndex p : evidence.tested()) {
            if (k < 10) continue;
            ++tested;
            free += evidence[p] == Evidence::kFree ? 1 : 0;
            occupied += is_occupied(evidence[p]) ? 1 : 0;
        }
    }
    ASSERT_GT(tested, 50000);
    EXPECT_LE(free, tested / 2000);
    EXPECT_GE(occupied, 0.8 * static_cast<double>(tested));
}

INSTANTIATE_TEST_SUITE_P(YawRates, Turning, testing::Values(0.0, 1.5, -1.5));

/// Something comes into view beside an edge: there no surface was seen, only the nearer one and the farther one.
TEST(FreeSpace, NoSurfaceWasSeenBetweenTheTwoOfAnEdge) {
    const SensorModel sensor = staggered_sensor();
    Frame frame(sensor);
    EvidenceImage evidence(sensor, {});
    bool appeared = false;
    const auto scene = [&](const auto& o, const auto& d) {
        const double wall = test::plane_range(Eigen::Vector3d::UnitX(), 16.0, o, d);
        const double pillar = test::box_range({8.0, -0.3, -0.5}, {8.4, 0.3, 4.0}, o, d);
        const double range = test::nearest(pillar, wall);
        return appeared ? test::nearest(range, test::box_range({11.0, -0.6, -0.5}, {11.4, 0.6, 4.0}, o, d)) : range;
    };
    for (int k = 0; k < 12; ++k) {
        appeared = k == 11;
        render_sweep(sensor, scene, k, 0.0, frame);
        evidence.begin(frame);
        for (PixelIndex p = 0; p < sensor.pixels(); ++p) {
            if (frame.cloud.range_m[p] > 0.0F) evidence.request(p);
        }
        evidence.run(frame);
    }
    long edges = 0, surfaces = 0;
    for (const PixelIndex p : evidence.tested()) {
        const double x = frame.odometry.x[p] + frame.odometry.T_world_sensor.translation().x();
        if (x < 10.5 || x > 12.0) continue;
        edges += evidence[p] == Evidence::kEdge ? 1 : 0;
        surfaces += evidence[p] == Evidence::kOccupied ? 1 : 0;
    }
    EXPECT_GT(edges, 10);
    EXPECT_EQ(surfaces, 0);
}

/// Nobody has ever seen the place free that it enters; but where it was before is seen free now.
TEST(FreeSpace, WhatMovesAwayIsNoLongerWhereItWas) {
    const SensorModel sensor = staggered_sensor();
    Frame frame(sensor);
    EvidenceImage evidence(sensor, {});
    double front = 6.0;
    const auto box = [&](const auto& o, const auto& d) {
        return test::box_range({front, -0.4, -0.5}, {front + 0.5, 0.4, 1.4}, o, d);
    };
    const auto scene = [&](const auto& o, const auto& d) {
        return test::nearest(box(o, d), test::plane_range(Eigen::Vector3d::UnitX(), 20.0, o, d));
    };
    for (int k = 0; k < 12; ++k, front += 0.13) {
        render_sweep(sensor, scene, k, 0.0, frame);
        evidence.begin(frame);
        for (PixelIndex p = 0; p < sensor.pixels(); ++p) {
            if (frame.cloud.range_m[p] > 0.0F) evidence.request(p);
        }
        evidence.run(frame);
    }
    long on_box = 0;
    long box_free = 0;
    long wall_free = 0;
    for (const PixelIndex p : evidence.tested()) {
        const bool free = evidence[p] == Evidence::kFree;
        if (frame.odometry.x[p] + frame.odometry.T_world_sensor.translation().x() > 15.0) {
            wall_free += free ? 1 : 0;
        } else {
            ++on_box;
            box_free += free ? 1 : 0;
        }
    }
    ASSERT_GT(on_box, 300);
    EXPECT_GE(box_free, 0.7 * static_cast<double>(on_box));
    EXPECT_EQ(wall_free, 0) << "came into view behind the box";
}

/// A leaf that begins to swing away behind a frame: the space that it enters has never been seen, and it was at rest
/// just before. Only where it has hardly moved it counts as where it was.
TEST(FreeSpace, ADoorThatOpensAwayIsSeenWithinThreeFrames) {
    const SensorModel sensor = staggered_sensor();
    Frame frame(sensor);
    EvidenceImage evidence(sensor, {});
    constexpr double kWall_m = 3.0, kWidth_m = 0.95, kHinge_m = -0.5;
    double angle_rad = 0.0;
    const auto leaf = [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        // In the leaf's own axes: along it, across it, up.
        const Eigen::AngleAxisd turn(-angle_rad, Eigen::Vector3d::UnitZ());
        const Eigen::Vector3d hinge(kHinge_m, kWall_m, 0.0);
        return test::box_range({0.0, 0.0, -0.5}, {kWidth_m, 0.05, 1.5}, turn * (o - hinge), turn * d);
    };
    const auto scene = [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        const double x = kHinge_m + kWidth_m;
        double range = test::box_range({-9.0, kWall_m, -0.5}, {kHinge_m, kWall_m + 0.1, 3.0}, o, d);
        range = test::nearest(range, test::box_range({x, kWall_m, -0.5}, {9.0, kWall_m + 0.1, 3.0}, o, d));
        range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitY(), 8.0, o, d));
        return test::nearest(range, leaf(o, d));
    };
    constexpr int kRest = 8;
    for (int k = 0; k <= kRest + 3; ++k) {
        angle_rad = std::max(0.0, 1.2 * kPeriod_s * (k - kRest));
        render_sweep(sensor, scene, k, 0.0, frame);
        evidence.begin(frame);
        for (PixelIndex p = 0; p < sensor.pixels(); ++p) {
            if (frame.cloud.range_m[p] > 0.0F) evidence.request(p);
        }
        evidence.run(frame);
        if (k != kRest && k != kRest + 3) continue;
        long on_leaf = 0, leaf_free = 0, wall_free = 0;
        for (const PixelIndex p : evidence.tested()) {
            const Eigen::Vector3d q =
                frame.odometry.T_world_sensor *
                Eigen::Vector3f(frame.odometry.x[p], frame.odometry.y[p], frame.odometry.z[p]).cast<double>();
            const bool free = evidence[p] == Evidence::kFree;
            const double along = q.x() - kHinge_m;
            const bool in_opening = along > 0.4 && along < kWidth_m && q.y() > kWall_m - 0.2 && q.y() < kWall_m + 1.0;
            on_leaf += in_opening ? 1 : 0;
            leaf_free += in_opening && free ? 1 : 0;
            wall_free += !in_opening && (along < 0.0 || along > kWidth_m + 0.1) && free ? 1 : 0;
        }
        ASSERT_GT(on_leaf, 200);
        EXPECT_LE(wall_free, 10);
        if (k == kRest) {
            EXPECT_EQ(leaf_free, 0) << "at rest";
        } else {
            EXPECT_GE(leaf_free, 0.6 * static_cast<double>(on_leaf)) << "three frames after it set off";
        }
    }
}

TEST(ReferenceImages, AgesAreSpreadAndMemoryIsBounded) {
    const SensorModel sensor = test::even_sensor(4, 64, 0.1, -0.1);
    Frame frame(sensor);
    frame.odometry.valid = true;
    ReferenceImages references(sensor, 5);
    EXPECT_TRUE(references.select().empty());
    for (int k = 0; k < 200; ++k) {
        frame.header.stamp_ns = k;
        references.insert(frame);
        if (k < 64) continue;
        std::vector<std::int64_t> ages;
        for (const Reference* reference : references.select()) ages.push_back(k + 1 - reference->stamp_ns);
        ASSERT_EQ(ages.size(), 6U);
        EXPECT_EQ(ages[0], 1);
        for (std::size_t i = 1; i < ages.size(); ++i) {
            // The i-th lies within the octave that ends at 2^i frames.
            EXPECT_GT(ages[i], 1 << (i - 1));
            EXPECT_LE(ages[i], 1 << i);
        }
    }
    references.clear();
    EXPECT_TRUE(references.select().empty());
}

}  // namespace
}  // namespace dlod
