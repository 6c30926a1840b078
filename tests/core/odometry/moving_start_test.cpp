// A robot that is in motion when it is switched on: where down is, and that nothing is given as good before it shows.
#include <gtest/gtest.h>

#include <cmath>

#include "core/odometry/start_level.hpp"
#include "tests/support/odometry_run.hpp"

namespace dlod::test {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// A robot's motion in its level plane, swaying a little, on ground that is tilted.
struct Start {
    const char* name;
    double speed_mps, acceleration_mps2, rate_radps;
    Eigen::Vector3d ground;  ///< rotation vector, rad
    double sway = 1.0;

    Eigen::Isometry3d pose(double t) const {
        // The path of a constant turn rate, by midpoints.
        constexpr int kSteps = 200;
        Eigen::Vector3d p(-4.0, -2.0, 0.0);
        for (int i = 0; i < kSteps; ++i) {
            const double u = t * (i + 0.5) / kSteps;
            const double v = speed_mps + acceleration_mps2 * u;
            p += t / kSteps * v * Eigen::Vector3d(std::cos(rate_radps * u), std::sin(rate_radps * u), 0.0);
        }
        const Eigen::Isometry3d tilted = make_pose(so3_exp(ground), Eigen::Vector3d::Zero());
        p.z() = sway * 0.01 * std::sin(12.0 * t);
        return tilted * make_pose(so3_exp({sway * 0.015 * std::sin(9.0 * t), 0.0, rate_radps * t}), p);
    }
};

class MotionAtStart : public testing::TestWithParam<Start> {};

TEST_P(MotionAtStart, TheWorldIsLevelledBeforeAPoseIsValid) {
    for (const std::uint64_t seed : {1, 2, 3}) {
        SCOPED_TRACE(seed);
        DriveOptions options;
        options.seed = seed;
        SimulatedDrive drive(
            furnished_room(), [](double t) { return GetParam().pose(t); }, options);
        OdometryRun run(drive, {});
        run.run(0, 14);
        const std::size_t first = run.first_valid();
        EXPECT_FALSE(run.frames[0].valid);
        EXPECT_LE(first, 7U);
        for (std::size_t i = first; i < run.frames.size(); ++i) {
            EXPECT_TRUE(run.frames[i].valid) << i;
            EXPECT_LT(run.tilt(i), 4.0 * kDegree) << i;
            EXPECT_LT(run.position_error(i), 0.03) << i;
        }
        // What earlier frames have seen belongs to another world; this one begins here.
        EXPECT_TRUE(run.frames[first].flags & OdometryResult::kReinitialized);
        EXPECT_LT(run.frames[first].estimate.translation().norm(), 1e-9);
        const Eigen::Vector3d x = run.frames[first].estimate.rotation() * Eigen::Vector3d::UnitX();
        EXPECT_NEAR(std::atan2(x.y(), x.x()), 0.0, 1e-9);
    }
}

TEST_P(MotionAtStart, WithoutImuThePosesAreValidFromTheSecondOn) {
    DriveOptions options;
    options.imu = false;
    SimulatedDrive drive(
        furnished_room(), [](double t) { return GetParam().pose(t); }, options);
    OdometryRun run(drive, {});
    run.run(0, 14);
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
        EXPECT_EQ(run.frames[i].valid, i > 0) << i;
        EXPECT_LT(run.position_error(i), 0.05) << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Odometry, MotionAtStart,
                         testing::Values(Start{"SpeedingUp", 1.0, 2.5, 0.0, {0.0, 0.0, 0.0}},
                                         Start{"Braking", 4.0, -2.0, 0.05, {0.0, 0.0, 0.0}},
                                         Start{"Turning", 2.5, 0.0, 1.0, {0.0, 0.0, 0.0}},
                                         Start{"SpeedingUpAndTurningOnASlope", 1.5, 2.0, 0.7, {0.1, -0.15, 0.0}}),
                         [](const auto& test) { return test.param.name; });

TEST(MotionAtStart, AtRestOnASlopeTheWorldIsLevelAtOnce) {
    const Start rest{"", 0.0, 0.0, 0.0, {0.15, -0.1, 0.0}, 0.0};
    SimulatedDrive drive(furnished_room(), [&](double t) { return rest.pose(t); });
    OdometryRun run(drive, {});
    run.run(0, 10);
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
        EXPECT_TRUE(run.frames[i].valid) << i;
        EXPECT_LT(run.tilt(i), 0.5 * kDegree) << i;
        EXPECT_FALSE(run.frames[i].flags & OdometryResult::kReinitialized) << i;
    }
}

/// A street whose houses leave little that faces along it, and a van before the robot that keeps its own speed.
std::vector<SceneBox> street_behind_a_van() {
    std::vector<SceneBox> scene = {{{-500, -9, -1}, {900, 9, 30}, true}};
    for (const double x : {-38.0, -16.0, 31.0, 52.0, 74.0}) {
        scene.push_back({{x, 7.5, -1}, {x + 4.0, 9, 6}});
        scene.push_back({{x + 9.0, -9, -1}, {x + 12.0, -7.8, 8}});
    }
    scene.push_back({{7.0, -1.0, -0.8}, {11.0, 1.0, 1.2}, false, {8.0, 0.0, 0.0}});
    return scene;
}

/// At 5 m/s for a second, then braking for two; on rough ground.
Eigen::Isometry3d arrival(double t) {
    t = std::min(t, 3.0);
    const double u = std::max(0.0, t - 1.0);
    return make_pose(so3_exp({0.015 * std::sin(9.0 * t), 0.0, 0.0}),
                     {5.0 * std::min(t, 1.0) + 5.0 * u - 1.25 * u * u, 0.0, 0.01 * std::sin(12.0 * t)});
}

TEST(MotionAtStart, ThatASingleVehicleTellsIsNotBelieved) {
    for (const bool use_imu : {true, false}) {
        SCOPED_TRACE(use_imu);
        SimulatedDrive drive(street_behind_a_van(), arrival);
        OdometryConfig config;
        config.use_imu = use_imu;
        OdometryRun run(drive, config);
        run.run(0, 45);
        EXPECT_LT(run.largest_position_error(), 0.1);
        // At the latest where it stands the robot knows.
        for (std::size_t i = 35; i < run.frames.size(); ++i) EXPECT_TRUE(run.frames[i].valid) << i;
    }
}

// Positions that do not come of the motion that the accelerometer feels: of a crowd, taken for the world.
TEST(StartLevel, TellsPositionsThatTheAccelerometerDoesNotExplain) {
    ImuBuffer imu;
    std::vector<ImuSample> samples(100);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        samples[i].stamp_ns = static_cast<std::int64_t>(i) * 10'000'000;
        samples[i].acceleration_mps2 = Eigen::Vector3f(2.0F, 0.0F, 9.80665F);
    }
    imu.add(samples);
    StartLevel moved, jolted;
    for (int k = 0; k < 6; ++k) {
        const double t = 0.1 * k;
        MotionState state;
        state.position_m = Eigen::Vector3d(3.0 * t + t * t, 1.0 * t, 0.0);
        moved.add(state, k * 100'000'000, imu);
        state.position_m.x() += k % 2 == 0 ? 0.03 : -0.03;
        jolted.add(state, k * 100'000'000, imu);
    }
    ASSERT_TRUE(moved.gravity().has_value());
    EXPECT_LT((moved.gravity()->mps2 - Eigen::Vector3d(0.0, 0.0, -9.80665)).norm(), 1e-3);
    EXPECT_LT(moved.gravity()->scatter, 1e-3);
    EXPECT_LT(moved.gravity()->deviation_mps2, 0.35);
    EXPECT_GT(jolted.gravity()->scatter, 4.0);
}

}  // namespace
}  // namespace dlod::test
