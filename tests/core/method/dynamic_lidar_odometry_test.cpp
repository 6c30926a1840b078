#include "core/dynamic_lidar_odometry.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/simulated_drive.hpp"

namespace dlod::test {
namespace {

Eigen::Isometry3d loop(double t) {
    const double a = 0.7 * after_rest(t) / 2.5;
    return make_pose(so3_exp({0.0, 0.0, a}), {2.5 * std::sin(a), 2.5 * (1.0 - std::cos(a)) - 1.0, 0.0});
}

std::vector<SceneBox> room_with_walker() {
    std::vector<SceneBox> scene = furnished_room();
    scene.push_back({{4.2, -3.0, -1}, {4.7, -2.5, 0.75}, false, {0.0, 1.2, 0}});
    return scene;
}

/// The whole method over a simulated drive.
class MethodRun {
  public:
    explicit MethodRun(std::vector<SceneBox> scene, const DriveOptions& options = {}, Trajectory trajectory = loop)
        : drive(std::move(scene), std::move(trajectory), options),
          frame(drive.sensor()),
          method(drive.sensor(), MethodConfig{}) {}

    void step(int k) {
        drive.fill(k, frame);
        frame.header.sequence = sequence_++;
        method.process(frame);
        const double stamp_s = static_cast<double>(frame.header.stamp_ns - SimulatedDrive::kEpoch_ns) * 1e-9;
        if (first_ && frame.odometry.valid) {
            T_truth_world_ = drive.pose(stamp_s) * frame.odometry.T_world_sensor.inverse();
            first_ = false;
        }
        if (frame.header.valid_columns > 0)
            error_m = (T_truth_world_ * frame.odometry.T_world_sensor.translation() - drive.pose(stamp_s).translation())
                          .norm();
    }

    SimulatedDrive drive;
    Frame frame;
    DynamicLidarOdometry method;
    double error_m = 0.0;  ///< of the last frame's position

  private:
    std::uint64_t sequence_ = 0;
    bool first_ = true;
    Eigen::Isometry3d T_truth_world_ = Eigen::Isometry3d::Identity();
};

struct Size {
    int height, width, first, last;
};

class Sizes : public testing::TestWithParam<Size> {};

// Every resolution and column window goes through the whole method.
TEST_P(Sizes, APoseAndAMoverAreFound) {
    const Size& size = GetParam();
    DriveOptions options;
    options.height = size.height;
    options.width = size.width;
    MethodRun run(room_with_walker(), options);
    run.drive.column_arrives = [&](int, int m) {
        return size.first <= size.last ? m >= size.first && m <= size.last : m >= size.first || m <= size.last;
    };
    int on_mover = 0, mover = 0, wrong = 0;
    for (int k = 0; k < 20; ++k) {
        run.step(k);
        ASSERT_TRUE(run.frame.odometry.valid) << k;
        ASSERT_LT(run.error_m, 0.06) << k;
        if (k < 8) continue;
        for (PixelIndex p = 0; p < run.frame.detection.label.size(); ++p) {
            const bool marked = run.frame.detection.label[p] == static_cast<std::uint8_t>(PixelLabel::kDynamic);
            const bool moves = run.drive.is_moving(p) && run.frame.cloud.range_m[p] > 0.0F;
            mover += moves;
            on_mover += marked && moves;
            wrong += marked && !moves;
        }
    }
    ASSERT_GT(mover, 100);
    // Few rows see little of it; what is marked is right.
    EXPECT_GT(on_mover, size.height >= 32 ? mover / 2 : 0);
    EXPECT_LE(wrong, on_mover / 10 + 20);
}

INSTANTIATE_TEST_SUITE_P(DynamicLidarOdometry, Sizes,
                         testing::Values(Size{16, 1024, 0, 1023}, Size{32, 512, 0, 511}, Size{64, 512, 200, 120},
                                         Size{32, 2048, 700, 1500}, Size{16, 4096, 0, 4095}),
                         [](const auto& test) {
                             return std::to_string(test.param.height) + "x" + std::to_string(test.param.width) +
                                    "from" + std::to_string(test.param.first) + "to" + std::to_string(test.param.last);
                         });

struct Mounting {
    const char* name;
    double period_s;
    Eigen::Vector3d rotation_rad;  ///< of the sensor against the robot
};

class Mountings : public testing::TestWithParam<Mounting> {};

// Any rate, and any way the sensor is mounted: the world is level whatever the sensor is.
TEST_P(Mountings, APoseAndAMoverAreFound) {
    const Mounting& mounting = GetParam();
    DriveOptions options;
    options.height = 64;
    options.period_s = mounting.period_s;
    MethodRun run(room_with_walker(), options, [&](double t) {
        const double u = std::max(0.0, t - 0.5);  // from rest, without a jolt that no IMU could follow
        Eigen::Isometry3d T = loop(u < 1.0 ? 0.5 * u * u : u - 0.5);
        T.linear() = T.linear() * so3_exp(mounting.rotation_rad).toRotationMatrix();
        return T;
    });
    int on_mover = 0, mover = 0, wrong = 0;
    const int frames = static_cast<int>(std::lround(2.5 / mounting.period_s));
    for (int k = 0; k < frames; ++k) {
        run.step(k);
        ASSERT_TRUE(run.frame.odometry.valid) << k;
        ASSERT_LT(run.error_m, 0.06) << k;
        if (k < frames / 2) continue;
        for (PixelIndex p = 0; p < run.frame.detection.label.size(); ++p) {
            const bool marked = run.frame.detection.label[p] == static_cast<std::uint8_t>(PixelLabel::kDynamic);
            const bool moves = run.drive.is_moving(p) && run.frame.cloud.range_m[p] > 0.0F;
            mover += moves;
            on_mover += marked && moves;
            wrong += marked && !moves;
        }
    }
    ASSERT_GT(mover, 100);
    EXPECT_GT(on_mover, mover / 2);
    EXPECT_LE(wrong, on_mover / 10 + 20);
}

INSTANTIATE_TEST_SUITE_P(DynamicLidarOdometry, Mountings,
                         testing::Values(Mounting{"FiveHertz", 0.2, {0, 0, 0}},
                                         Mounting{"TwentyHertz", 0.05, {0, 0, 0}},
                                         Mounting{"Inverted", 0.1, {3.14159, 0, 0}},
                                         Mounting{"Tilted", 0.1, {0.0, 0.5, 0.0}},
                                         Mounting{"OnItsSide", 0.1, {1.5708, 0, 0}}),
                         [](const auto& test) { return test.param.name; });

// After a gap the robot is somewhere else than the map says: what was seen from the old place is no evidence.
TEST(DynamicLidarOdometry, NothingMovesAfterARestartInARoomWhereNothingMoves) {
    DriveOptions options;
    options.height = 64;
    MethodRun run(furnished_room(), options);
    for (int k = 0; k < 12; ++k) run.step(k);
    const std::uint32_t first_id = [&] {
        std::uint32_t highest = 0;
        for (const Track& track : run.frame.detection.tracks) highest = std::max(highest, track.id);
        return highest + 1;
    }();
    run.step(75);
    EXPECT_FALSE(run.frame.odometry.valid);
    EXPECT_TRUE(run.frame.odometry.flags & OdometryResult::kReinitialized);
    for (int k = 76; k < 92; ++k) {
        run.step(k);
        EXPECT_TRUE(run.frame.odometry.valid);
        EXPECT_EQ(run.frame.detection.dynamic_points, 0) << k;
        // Objects of the old place are not those of the new one.
        for (const Track& track : run.frame.detection.tracks) EXPECT_GE(track.id, first_id) << k;
    }
}

// The reference's path, trajectory and spaciousness grow for ever.
TEST(DynamicLidarOdometry, MemoryDoesNotGrowWhereTheRobotGoesInCircles) {
    const auto small_circle = [](double t) {
        const double u = std::max(0.0, t - 0.5);
        const double a = 1.6 * (u < 1.0 ? 0.5 * u * u : u - 0.5);
        return make_pose(so3_exp({0.0, 0.0, a}), {std::sin(a), 1.0 - std::cos(a), 0.0});
    };
    DriveOptions options;
    options.height = 16;
    MethodRun run(room_with_walker(), options, small_circle);
    const auto bytes = [] { return static_cast<double>(::mallinfo2().uordblks + ::mallinfo2().hblkhd); };
    for (int k = 0; k < 120; ++k) run.step(k);
    const double before = bytes();
    for (int k = 120; k < 280; ++k) run.step(k);
    // Four rounds more: the map's last cells, no more than that.
    EXPECT_LT(bytes() - before, 300e3);
    EXPECT_LT(run.error_m, 0.1);
}

TEST(DynamicLidarOdometry, FramesWithoutColumnsOrReturnsAreSurvived) {
    MethodRun run(room_with_walker());
    std::set<int> empty = {0, 1, 15, 16, 17, 30};
    std::uint32_t walker = 0;
    run.drive.column_arrives = [&](int k, int) { return empty.count(k) == 0; };
    for (int k = 0; k < 40; ++k) {
        run.step(k);
        if (empty.count(k) == 0) {
            EXPECT_TRUE(run.frame.odometry.valid) << k;
            // The walker is still the same one.
            for (const Track& track : run.frame.detection.tracks) {
                if (track.state != DynamicState::kDynamic) continue;
                EXPECT_TRUE(walker == 0 || walker == track.id) << k;
                walker = track.id;
            }
        } else {
            EXPECT_FALSE(run.frame.odometry.valid) << k;
            EXPECT_EQ(run.frame.detection.dynamic_points, 0);
        }
    }
    EXPECT_NE(walker, 0U);
    EXPECT_LT(run.error_m, 0.05);

    MethodRun dark({});  // nothing but sky
    for (int k = 0; k < 10; ++k) dark.step(k);
    EXPECT_EQ(dark.frame.detection.dynamic_points, 0);
    dark.method.map().finish();
    EXPECT_TRUE(dark.method.map().points().empty());
}

}  // namespace
}  // namespace dlod::test
