#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "tests/support/odometry_run.hpp"

namespace dlod::test {
namespace {

constexpr std::uint32_t kDegenerate = OdometryResult::kDegenerate;

Eigen::Isometry3d at(double x, double y, double yaw) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(x, y, 0.0);
    T.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T;
}

/// At rest for a second, then up to a speed at 3 m/s^2, swaying a little.
Trajectory along_x(double speed_mps) {
    return [=](double t) {
        const double u = std::max(0.0, t - 1.0);
        const double rise_s = speed_mps / 3.0;
        const double x = u < rise_s ? 1.5 * u * u : speed_mps * (u - 0.5 * rise_s);
        const double sway = std::min(1.0, u) * std::sin(2.0 * u);
        return at(x, 0.05 * sway, 0.03 * sway);
    };
}

std::vector<SceneBox> bare_tunnel() {
    return {{{-500, -3, -1}, {900, 3, 4}, true}};
}

double largest_deviation(const RunFrame& f) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(f.covariance.topLeftCorner<3, 3>());
    return std::sqrt(solver.eigenvalues()[2]);
}

class BareTunnel : public testing::TestWithParam<std::uint64_t> {};

TEST_P(BareTunnel, IsFollowedByTheImuForSecondsAndThenNotCalledValid) {
    DriveOptions options;
    options.seed = GetParam();
    options.max_range_m = 60.0;
    SimulatedDrive drive(bare_tunnel(), along_x(2.0 + static_cast<double>(GetParam())), options);
    OdometryRun run(drive, {});
    run.run(0, 90);
    for (std::size_t i = 2; i < run.frames.size(); ++i) {
        const RunFrame& f = run.frames[i];
        EXPECT_TRUE(f.flags & kDegenerate);
        // Across the tunnel the walls hold.
        const Eigen::Vector3d error = f.truth.rotation() * run.relative_error(0, i).translation();
        EXPECT_LT(error.tail<2>().norm(), 0.03) << i;
        EXPECT_LT(std::abs(error.x()), 4.0 * largest_deviation(f) + 0.02) << i;
        if (f.valid) {
            EXPECT_LT(largest_deviation(f), 0.31) << i;
            EXPECT_LT(std::abs(error.x()), 0.7) << i;
        }
    }
    EXPECT_TRUE(run.frames[25].valid);
    EXPECT_FALSE(run.frames.back().valid);
}

INSTANTIATE_TEST_SUITE_P(Degeneracy, BareTunnel, testing::Values(1, 2, 3));

TEST(Degeneracy, ABareTunnelWithoutImuIsNotCalledValid) {
    DriveOptions options;
    options.max_range_m = 60.0;
    SimulatedDrive drive(bare_tunnel(), along_x(3.0), options);
    OdometryConfig config;
    config.use_imu = false;
    OdometryRun run(drive, config);
    run.run(0, 30);
    for (std::size_t i = 2; i < run.frames.size(); ++i) {
        EXPECT_FALSE(run.frames[i].valid);
        EXPECT_TRUE(run.frames[i].flags & kDegenerate);
    }
}

TEST(Degeneracy, MotionFromTheStartInABareTunnelIsNotTakenForRest) {
    DriveOptions options;
    options.max_range_m = 60.0;
    SimulatedDrive drive(
        bare_tunnel(), [](double t) { return at(3.0 * t, 0.03 * std::sin(9.0 * t), 0.02 * std::sin(7.0 * t)); },
        options);
    OdometryRun run(drive, {});
    run.run(0, 20);
    for (std::size_t i = 2; i < run.frames.size(); ++i) EXPECT_FALSE(run.frames[i].valid);
}

// The little that faces along the tunnel of what overtakes the robot would be found at any place, as nothing is known
// of the motion there.
TEST(Degeneracy, MotionFromTheStartInATunnelIsNotToldByTheLittleThatOvertakes) {
    std::vector<SceneBox> scene = bare_tunnel();
    for (const double x : {-5.0, -9.0, -13.0}) {
        scene.push_back({{x, 0.8, -1.0}, {x + 0.8, 1.6, -0.2}, false, {4.0, 0.0, 0.0}});
    }
    DriveOptions options;
    options.max_range_m = 60.0;
    SimulatedDrive drive(
        scene, [](double t) { return at(3.0 * t, 0.03 * std::sin(9.0 * t), 0.02 * std::sin(7.0 * t)); }, options);
    OdometryRun run(drive, {});
    run.run(0, 70);
    for (std::size_t i = 0; i < run.frames.size(); ++i) EXPECT_FALSE(run.frames[i].valid) << i;
}

TEST(Degeneracy, StructureTakesTheDirectionBack) {
    std::vector<SceneBox> scene = bare_tunnel();
    for (const double x : {0.0, 50.0}) {
        scene.push_back({{x + 3.0, 2.0, -1}, {x + 3.5, 3, 4}});
        scene.push_back({{x + 6.0, -3, -1}, {x + 6.6, -1.8, 4}});
        scene.push_back({{x - 5.0, -3, -1}, {x - 4.0, -1.6, 2}});
        scene.push_back({{x - 2.0, 1.8, -1}, {x - 1.6, 3, 4}});
        scene.push_back({{x + 9.0, 1.5, -1}, {x + 9.5, 3, 4}});
    }
    DriveOptions options;
    options.max_range_m = 14.0;
    SimulatedDrive drive(scene, along_x(6.0), options);
    OdometryRun run(drive, {});
    run.run(0, 110);
    EXPECT_FALSE(run.frames[10].flags & kDegenerate);
    EXPECT_TRUE(run.frames[60].flags & kDegenerate);
    EXPECT_FALSE(run.frames[105].flags & kDegenerate);
    EXPECT_TRUE(run.frames[105].valid);
    const Eigen::Vector3d error = run.frames[105].truth.rotation() * run.relative_error(0, 105).translation();
    EXPECT_LT(error.norm(), 4.0 * largest_deviation(run.frames[105]) + 0.05);
    // From there on it is as exact as ever.
    EXPECT_LT(run.relative_error(100, 109).translation().norm(), 0.03);
}

TEST(Degeneracy, AnOpenPlaneHoldsHeightAndLevel) {
    // Nothing but the ground within reach.
    const std::vector<SceneBox> plain = {{{-500, -500, -1.2}, {500, 500, 400}, true}};
    DriveOptions options;
    options.max_range_m = 60.0;
    SimulatedDrive drive(plain, along_x(2.0), options);
    OdometryRun run(drive, {});
    run.run(0, 40);
    for (std::size_t i = 2; i < run.frames.size(); ++i) {
        EXPECT_TRUE(run.frames[i].flags & kDegenerate);
        const Eigen::Vector3d error = run.frames[i].truth.rotation() * run.relative_error(0, i).translation();
        EXPECT_LT(std::abs(error.z()), 0.03) << i;
        EXPECT_LT(error.norm(), 4.0 * std::sqrt(run.frames[i].covariance.topLeftCorner<3, 3>().trace()) + 0.03) << i;
    }
}

}  // namespace
}  // namespace dlod::test
