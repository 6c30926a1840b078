#include "core/odometry/odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/odometry_run.hpp"

namespace dlod::test {
namespace {

constexpr double kPi = std::numbers::pi;

Eigen::Isometry3d pose_of(double x, double y, double z, double yaw, double pitch = 0.0, double roll = 0.0) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(x, y, z);
    T.linear() =
        (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    return T;
}

/// At rest for half a second, then a loop at a walking pace with the sway of a gait.
Eigen::Isometry3d walk(double t) {
    const double u = std::max(0.0, t - 0.5);
    const double s = u < 1.0 ? 0.5 * u * u : u - 0.5;  // metres
    const double a = s / 2.5;
    const double sway = std::min(u, 1.0) * std::min(u, 1.0);
    return pose_of(2.5 * std::sin(a), 2.5 * (1.0 - std::cos(a)) - 1.0, 0.02 * sway * std::sin(9.0 * u), a,
                   0.02 * sway * std::sin(7.0 * u), 0.03 * sway * std::sin(5.0 * u));
}

OdometryConfig without_imu() {
    OdometryConfig config;
    config.use_imu = false;
    return config;
}

TEST(Odometry, FollowsAWalkWithImu) {
    SimulatedDrive drive(furnished_room(), walk);
    OdometryRun run(drive, {});
    run.run(0, 60);
    EXPECT_LT(run.largest_position_error(), 0.02);
    EXPECT_LT(so3_log(Eigen::Quaterniond(run.relative_error(0, 59).rotation())).norm(), 0.003);
    for (const RunFrame& f : run.frames) {
        EXPECT_TRUE(f.valid);
        EXPECT_EQ(f.flags, static_cast<std::uint32_t>(OdometryResult::kImuUsed));
    }
}

TEST(Odometry, FollowsAWalkWithoutImu) {
    SimulatedDrive drive(furnished_room(), walk);
    OdometryRun run(drive, without_imu());
    run.run(0, 60);
    EXPECT_LT(run.largest_position_error(), 0.05);
    EXPECT_EQ(run.first_valid(), 1U);
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
        EXPECT_EQ(run.frames[i].valid, i > 0) << i;
        EXPECT_EQ(run.frames[i].flags, 0U) << i;
    }
}

TEST(Odometry, StandsStillWithinAMillimetre) {
    SimulatedDrive drive(furnished_room(), [](double) { return pose_of(0, 0, 0, 0.3, 0.02, -0.03); });
    OdometryRun run(drive, {});
    run.run(0, 200);
    for (std::size_t i = 6; i < run.frames.size(); ++i) {
        EXPECT_LT(run.relative_error(5, i).translation().norm(), 0.001);
    }
}

TEST(Odometry, LevelsTheWorldOnASlope) {
    const Eigen::Isometry3d pose = pose_of(0, 0, 0, 0.4, 0.2, -0.15);
    DriveOptions options;
    options.accelerometer_bias_mps2.setZero();
    SimulatedDrive drive(
        furnished_room(), [&](double) { return pose; }, options);
    OdometryRun run(drive, {});
    run.run(0, 3);
    const Eigen::Vector3d up_truth = pose.rotation().transpose() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d up_estimate = run.frames[0].estimate.rotation().transpose() * Eigen::Vector3d::UnitZ();
    EXPECT_LT((up_truth - up_estimate).norm(), 0.005);
    const Eigen::Vector3d x = run.frames[0].estimate.rotation() * Eigen::Vector3d::UnitX();
    EXPECT_NEAR(std::atan2(x.y(), x.x()), 0.0, 1e-9);
    EXPECT_LT(run.frames[0].estimate.translation().norm(), 1e-9);
}

class MovingStart : public testing::TestWithParam<bool> {};

TEST_P(MovingStart, FindsItsVelocityFromTheSecondFrameOn) {
    SimulatedDrive drive(furnished_room(), [](double t) { return pose_of(-5.0 + 3.0 * t, -1.0, 0.0, 0.3 * t); });
    OdometryConfig config;
    config.use_imu = GetParam();
    OdometryRun run(drive, config);
    run.run(0, 25);
    EXPECT_LT(run.largest_position_error(), 0.04);
    EXPECT_NEAR(run.frames[2].linear_velocity.norm(), 3.0, 0.1);
    EXPECT_TRUE(run.frames.back().valid);
}

TEST_P(MovingStart, FindsSixMetresASecondToo) {
    for (const double heading : {0.0, 2.0}) {
        SCOPED_TRACE(heading);
        SimulatedDrive drive(furnished_room(), [&](double t) {
            const double s = 6.0 * t - 3.0;
            return pose_of(s * std::cos(heading), s * std::sin(heading), 0.0, 0.2);
        });
        OdometryConfig config;
        config.use_imu = GetParam();
        OdometryRun run(drive, config);
        run.run(0, 8);
        EXPECT_LT(run.largest_position_error(), 0.08);
        EXPECT_NEAR(run.frames[2].linear_velocity.norm(), 6.0, 0.2);
    }
}

// Nothing that was learnt from a scan that was deskewed for another motion than it had may be kept.
TEST_P(MovingStart, TheFirstScanIsVoidWhereItWasInMotion) {
    OdometryConfig config;
    config.use_imu = GetParam();
    for (const double speed_mps : {0.0, 3.0}) {
        SCOPED_TRACE(speed_mps);
        SimulatedDrive drive(furnished_room(), [&](double t) { return pose_of(speed_mps * t - 2.0, -1.0, 0.0, 0.2); });
        OdometryRun run(drive, config);
        run.step(0);
        EXPECT_FALSE(run.frame().odometry.void_scan_ns.has_value());
        const std::int64_t first_ns = run.frame().header.stamp_ns;
        run.step(1);
        if (speed_mps > 0.0) {
            EXPECT_EQ(run.frame().odometry.void_scan_ns, first_ns);
            EXPECT_TRUE(run.frame().odometry.earlier_is_void());
        } else {
            EXPECT_FALSE(run.frame().odometry.earlier_is_void());
        }
        run.step(2);
        EXPECT_FALSE(run.frame().odometry.earlier_is_void());
    }
}

INSTANTIATE_TEST_SUITE_P(Odometry, MovingStart, testing::Bool());

TEST(Odometry, SurvivesTurnsOfFiveRadiansASecond) {
    SimulatedDrive drive(furnished_room(), [](double t) {
        const double u = std::max(0.0, t - 0.5);
        return pose_of(0.2 * u, 0, 0, u < 1.0 ? 2.5 * u * u : 5.0 * u - 2.5);
    });
    OdometryRun run(drive, {});
    run.run(0, 40);
    EXPECT_LT(run.largest_position_error(), 0.03);
    for (const RunFrame& f : run.frames) EXPECT_TRUE(f.valid);
}

TEST(Odometry, SurvivesAKickOfTwoG) {
    // 20 m/s^2 for 50 ms: 1 m/s, taken back as hard half a second later.
    const auto kicked = [](double t) {
        const auto ramp = [](double u) { return u <= 0.0 ? 0.0 : u < 0.05 ? 10.0 * u * u : 0.025 + (u - 0.05); };
        return pose_of(ramp(t - 1.03) - ramp(t - 1.53), 0.3 * t, 0, 0);
    };
    for (const bool imu : {true, false}) {
        SCOPED_TRACE(imu);
        SimulatedDrive drive(furnished_room(), kicked);
        OdometryConfig config;
        config.use_imu = imu;
        OdometryRun run(drive, config);
        run.run(0, 30);
        EXPECT_LT(run.largest_position_error(), imu ? 0.03 : 0.06);
        EXPECT_TRUE(run.frames.back().valid);
    }
}

TEST(Odometry, WorksWithSixtyPercentOfTheColumnsMissing) {
    SimulatedDrive drive(furnished_room(), walk);
    drive.column_arrives = [](int k, int m) { return k < 10 || (m / 16 * 7 + k * 3) % 10 < 4; };
    OdometryRun run(drive, {});
    run.run(0, 50);
    EXPECT_LT(run.largest_position_error(), 0.03);
}

TEST(Odometry, BridgesAGapOfASecond) {
    for (const bool imu : {true, false}) {
        SimulatedDrive drive(furnished_room(), walk);
        OdometryConfig config;
        config.use_imu = imu;
        OdometryRun run(drive, config);
        SCOPED_TRACE(imu);
        run.run(0, 25);
        run.run(35, 60);
        EXPECT_LT(run.position_error(run.frames.size() - 1), 0.05);
        EXPECT_LT(run.largest_position_error(), 0.05);
        EXPECT_TRUE(run.frames.back().valid);
    }
}

TEST(Odometry, PredictsThroughUnusableFramesAndThenGivesUp) {
    SimulatedDrive drive(furnished_room(), walk);
    drive.column_arrives = [](int k, int m) { return k < 20 || k >= 38 || m < 100; };
    OdometryRun run(drive, {});
    run.run(0, 45);
    EXPECT_TRUE(run.frames[20].valid);
    EXPECT_TRUE(run.frames[20].flags & OdometryResult::kPredictedOnly);
    EXPECT_LT(run.position_error(22), 0.05);
    EXPECT_FALSE(run.frames[36].valid);  // nothing for 1.6 s
    EXPECT_TRUE(run.frames[40].valid);
    EXPECT_FALSE(run.frames[40].flags & OdometryResult::kPredictedOnly);
}

struct ImuFault {
    const char* name;
    std::function<void(ImuSample&, double)> spoil;
};

class FaultyImu : public testing::TestWithParam<ImuFault> {};

TEST_P(FaultyImu, IsFlaggedAndDoesNoHarm) {
    SimulatedDrive drive(furnished_room(), walk);
    drive.spoil_imu = [&](ImuSample& s) {
        const double t = static_cast<double>(s.stamp_ns - SimulatedDrive::kEpoch_ns) * 1e-9;
        if (t > 2.0) GetParam().spoil(s, t);
    };
    OdometryRun run(drive, {});
    run.run(0, 60);
    EXPECT_TRUE(run.any(OdometryResult::kImuFaulty));
    EXPECT_LT(run.largest_position_error(), 0.06);
    for (const RunFrame& f : run.frames) EXPECT_TRUE(f.valid);
    for (std::size_t i = 0; i < 20; ++i) EXPECT_FALSE(run.frames[i].flags & OdometryResult::kImuFaulty);
}

INSTANTIATE_TEST_SUITE_P(
    Odometry, FaultyImu,
    testing::Values(ImuFault{"NoNumbers",
                             [](ImuSample& s, double) { s.angular_velocity_radps.setConstant(std::nanf("")); }},
                    ImuFault{"Silent", [](ImuSample& s, double) { s.stamp_ns = 0; }},
                    ImuFault{"Stuck",
                             [](ImuSample& s, double) {
                                 s.angular_velocity_radps = Eigen::Vector3f(0.1F, 0.2F, 0.3F);
                                 s.acceleration_mps2 = Eigen::Vector3f(0.0F, 0.0F, 9.8F);
                             }},
                    ImuFault{"Spikes",
                             [](ImuSample& s, double seconds) {
                                 if (std::llround(seconds * 100.0) % 7 < 2) s.angular_velocity_radps.setConstant(8.0F);
                             }},
                    ImuFault{"WrongAxes",
                             [](ImuSample& s, double) {
                                 s.angular_velocity_radps =
                                     Eigen::Vector3f(s.angular_velocity_radps.z(), s.angular_velocity_radps.x(),
                                                     s.angular_velocity_radps.y());
                                 s.acceleration_mps2 = Eigen::Vector3f(s.acceleration_mps2.z(), s.acceleration_mps2.x(),
                                                                       s.acceleration_mps2.y());
                             }},
                    ImuFault{"WrongScale", [](ImuSample& s, double) { s.angular_velocity_radps *= 57.3F; }}),
    [](const auto& test) { return test.param.name; });

TEST(Odometry, TakesTheImuBackAfterItHasRecovered) {
    SimulatedDrive drive(furnished_room(), walk);
    drive.spoil_imu = [](ImuSample& s) {
        const double t = static_cast<double>(s.stamp_ns - SimulatedDrive::kEpoch_ns) * 1e-9;
        if (t > 1.0 && t < 1.5) s.angular_velocity_radps.setConstant(std::nanf(""));
    };
    OdometryRun run(drive, {});
    run.run(0, 50);
    EXPECT_TRUE(run.any(OdometryResult::kImuFaulty));
    EXPECT_EQ(run.frames.back().flags, static_cast<std::uint32_t>(OdometryResult::kImuUsed));
}

TEST(Odometry, HoldsTheDirectionThatATunnelHides) {
    // Out of a portal into a tunnel at 6 m/s: soon nothing tells how far.
    const std::vector<SceneBox> tunnel = {{{-4, -3, -1}, {500, 3, 4}, true}};
    const auto drive_along = [](double t) {
        const double u = std::max(0.0, t - 0.5);
        return pose_of(u < 1.0 ? 3.0 * u * u : 6.0 * u - 3.0, 0.1 * std::sin(u), 0, 0.05 * std::sin(u));
    };
    SimulatedDrive drive(tunnel, drive_along);
    OdometryRun run(drive, {});
    run.run(0, 55);
    const RunFrame& last = run.frames.back();
    EXPECT_TRUE(last.flags & OdometryResult::kDegenerate);
    EXPECT_FALSE(run.frames[5].flags & OdometryResult::kDegenerate);
    const Eigen::Vector3d error = last.truth.rotation() * run.relative_error(0, 54).translation();
    EXPECT_LT(error.tail<2>().norm(), 0.03);
    // Along the tunnel only the IMU speaks: it drifts slowly, and the covariance says so.
    EXPECT_LT(std::abs(error.x()), 0.5);
    EXPECT_GT(last.covariance(0, 0), 25.0 * last.covariance(1, 1));
    EXPECT_LT(std::abs(error.x()), 4.0 * std::sqrt(last.covariance(0, 0)));
}

TEST(Odometry, IsNotCarriedAwayByABusThatFillsHalfOfTheView) {
    std::vector<SceneBox> scene = furnished_room();
    scene.push_back({{-20, 1.2, -1}, {-12, 3.5, 2.5}, false, {4.0, 0, 0}});
    for (const bool imu : {true, false}) {
        SimulatedDrive drive(scene, [](double t) { return pose_of(0.3 * std::max(0.0, t - 0.5), 0, 0, 0); });
        OdometryConfig config;
        config.use_imu = imu;
        OdometryRun run(drive, config);
        SCOPED_TRACE(imu);
        run.run(0, 45);
        // The bus has gone 18 m by then.
        EXPECT_LT(run.largest_position_error(), 0.08);
    }
}

TEST(Odometry, ShowsMovingObjectsByHighResiduals) {
    std::vector<SceneBox> scene = furnished_room();
    scene.push_back({{2, -1, -1}, {2.5, -0.5, 0.8}, false, {0, 1.0, 0}});
    SimulatedDrive drive(scene, [](double) { return pose_of(0, 0, 0, 0); });
    OdometryRun run(drive, {});
    run.run(0, 20);
    const Frame& frame = run.frame();
    double on = 0.0, off = 0.0;
    int on_count = 0, off_count = 0;
    for (std::size_t i = 0; i < frame.odometry.residual_pixel.size(); ++i) {
        const PixelIndex p = frame.odometry.residual_pixel[i];
        const Eigen::Vector3f q(frame.odometry.x[p], frame.odometry.y[p], frame.odometry.z[p]);
        const float y = q.y() + 0.75F - static_cast<float>(drive.stamp_s(19));
        const bool hit = q.x() > 1.9F && q.x() < 2.6F && std::abs(y) < 0.3F && q.z() > -0.8F;
        (hit ? on : off) += static_cast<double>(frame.odometry.residual_m[i]);
        (hit ? on_count : off_count) += 1;
    }
    ASSERT_GT(on_count, 10);
    EXPECT_GT(on / on_count, 0.3);
    EXPECT_LT(off / off_count, 0.05);
}

TEST(Odometry, IsDeterministic) {
    std::vector<RunFrame> first;
    for (int pass = 0; pass < 2; ++pass) {
        SimulatedDrive drive(furnished_room(), walk);
        OdometryRun run(drive, {});
        run.run(0, 20);
        if (pass == 0) {
            first = run.frames;
            continue;
        }
        for (std::size_t i = 0; i < first.size(); ++i) {
            EXPECT_EQ(first[i].estimate.matrix(), run.frames[i].estimate.matrix());
            EXPECT_EQ(first[i].covariance, run.frames[i].covariance);
        }
    }
}

TEST(Odometry, DeskewsTheCloudIntoTheStamp) {
    SimulatedDrive drive(furnished_room(), walk);
    OdometryRun run(drive, {});
    run.run(0, 30);
    const Frame& frame = run.frame();
    // Each deskewed point, placed by the true pose at the stamp, lies where its own column saw it.
    const Eigen::Isometry3d stamp = run.frames.back().truth;
    double worst = 0.0;
    for (int r = 0; r < drive.sensor().height; ++r) {
        for (int c = 0; c < drive.sensor().width; ++c) {
            if (frame.cloud.range_m(r, c) <= 0.0F) {
                EXPECT_EQ(frame.odometry.x(r, c), 0.0F);
                continue;
            }
            const int m = drive.sensor().measurement_of(r, c);
            const double t =
                static_cast<double>(frame.columns.time_ns[static_cast<std::size_t>(m)] - SimulatedDrive::kEpoch_ns) *
                1e-9;
            const Eigen::Vector3d truth =
                drive.pose(t) *
                Eigen::Vector3f(frame.cloud.x(r, c), frame.cloud.y(r, c), frame.cloud.z(r, c)).cast<double>();
            const Eigen::Vector3d deskewed =
                stamp *
                Eigen::Vector3f(frame.odometry.x(r, c), frame.odometry.y(r, c), frame.odometry.z(r, c)).cast<double>();
            worst = std::max(worst, (truth - deskewed).norm());
        }
    }
    EXPECT_LT(worst, 0.02);
}

}  // namespace
}  // namespace dlod::test
