#include "tools/sim/imu_simulator.hpp"

#include <gtest/gtest.h>

#include "core/types/lie.hpp"
#include "driver/imu.hpp"
#include "tests/tools/sim/recorded_drive.hpp"

namespace dlod::tools::sim::test {
namespace {

RobotMotion lively_motion(const ArcPath& path) {
    const RobotOptions options{.speed_mps = 1.5, .standing_s = 0.5, .kicks_s = {2.0}, .turns_s = {3.0}};
    return {path, [](double x, double) { return 0.1 * x; }, options, 6.0};
}

ArcPath bent_path() {
    return {{Vec2(0, 0), Vec2(4, 0), Vec2(6, 3), Vec2(3, 6), Vec2(-1, 3)}, true, 1.5};
}

SensorModel sensor_with_lever() {
    SensorModel sensor;
    sensor.T_sensor_imu =
        make_pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())), Vec3(0.05, -0.02, 0.03));
    return sensor;
}

TEST(ImuSimulator, IntegratesToTheTrueRotationAndVelocity) {
    const ArcPath path = bent_path();
    const RobotMotion robot = lively_motion(path);
    const SensorModel sensor = sensor_with_lever();
    const ImuSimulator imu(robot, sensor, 1, false);
    const auto pose = [&](double t) { return Eigen::Isometry3d(robot.T_world_sensor(t) * sensor.T_sensor_imu); };
    constexpr double kStep_s = 5e-4;
    Eigen::Quaterniond q(pose(0.0).linear());
    Vec3 velocity = Vec3::Zero();
    Vec3 position = pose(0.0).translation();
    for (int i = 0; i < 10000; ++i) {
        const ImuReading r = imu.truth((i + 0.5) * kStep_s);
        const Eigen::Quaterniond middle = q * so3_exp(0.5 * kStep_s * r.angular_velocity_radps);
        const Vec3 acceleration = middle * r.acceleration_mps2 - Vec3(0.0, 0.0, 9.80665);
        position += velocity * kStep_s + 0.5 * kStep_s * kStep_s * acceleration;
        velocity += acceleration * kStep_s;
        q = (q * so3_exp(kStep_s * r.angular_velocity_radps)).normalized();
    }
    const Eigen::Isometry3d truth = pose(5.0);
    EXPECT_LT(Eigen::Quaterniond(truth.linear()).angularDistance(q), 1e-3);
    EXPECT_LT((truth.translation() - position).norm(), 0.02);
}

TEST(ImuSimulator, KickAndTurnAreAsHardAsTheySay) {
    const ArcPath path = bent_path();
    const RobotMotion robot = lively_motion(path);
    const ImuSimulator imu(robot, sensor_with_lever(), 1, false);
    double hardest = 0.0;
    double fastest = 0.0;
    for (double t = 0.0; t < 6.0; t += 0.001) {
        const ImuReading r = imu.truth(t);
        hardest = std::max(hardest, std::abs(r.acceleration_mps2.norm() - 9.81));
        fastest = std::max(fastest, r.angular_velocity_radps.norm());
    }
    EXPECT_GT(hardest, 10.0);
    EXPECT_GT(fastest, 4.5);
    EXPECT_LT(fastest, 9.0);
}

TEST(ImuSimulator, AStandingRobotFeelsGravityOnly) {
    const ArcPath path = bent_path();
    const RobotMotion robot(
        path, [](double, double) { return 0.0; }, {.speed_mps = 0.0}, 5.0);
    const ImuSimulator imu(robot, SensorModel{}, 1, false);
    for (double t = 0.0; t < 5.0; t += 0.37) {
        EXPECT_LT((imu.truth(t).acceleration_mps2 - Vec3(0.0, 0.0, 9.80665)).norm(), 1e-6);
        EXPECT_LT(imu.truth(t).angular_velocity_radps.norm(), 1e-9);
        EXPECT_LT((robot.T_world_sensor(t).translation() - robot.T_world_sensor(0.0).translation()).norm(), 1e-12);
    }
}

TEST(ImuSimulator, FaultsOfTheImuAppear) {
    DriveSettings settings;
    settings.world.duration_s = 1.0;
    const auto readings = [&](ImuFault fault) {
        settings.faults.imu = fault;
        std::vector<ImuSample> samples;
        const RecordedDrive drive = record(settings);
        for (const Datagram& d : drive.datagrams) {
            if (!d.imu) continue;
            if (const auto sample = driver::decode_imu_packet(d.bytes)) samples.push_back(*sample);
        }
        return samples;
    };
    EXPECT_EQ(readings(ImuFault::kNone).size(), 100U);
    EXPECT_TRUE(readings(ImuFault::kOff).empty());
    EXPECT_NEAR(static_cast<double>(readings(ImuFault::kSilent).size()), 40.0, 2.0);
    const auto stuck = readings(ImuFault::kStuck);
    EXPECT_EQ(stuck[60].acceleration_mps2, stuck[90].acceleration_mps2);
    const auto axes = readings(ImuFault::kAxes);
    EXPECT_LT(std::abs(axes[10].acceleration_mps2.z()), 3.0F);
}

}  // namespace
}  // namespace dlod::tools::sim::test
