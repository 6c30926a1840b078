#include "daemon/publish/pose_publisher.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/types/lie.hpp"
#include "tests/support/recording_bus.hpp"
#include "tests/support/synthetic_frame.hpp"

namespace dlod::daemon {
namespace {

using test::RecordingBus;

TEST(PosePublisher, PosesAreTheBases) {
    Frame frame(test::small_sensor());
    auto& odometry = frame.odometry;
    odometry.valid = true;
    odometry.flags = OdometryResult::kImuUsed | OdometryResult::kPredictedOnly;
    // The sensor looks backwards, half a metre ahead of and one above the base, and turns about the base's z.
    const Eigen::Isometry3d T_base_sensor =
        make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, M_PI)), Eigen::Vector3d(0.5, 0.0, 1.0));
    const Eigen::Isometry3d T_odom_base =
        make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, 0.3)), Eigen::Vector3d(4.0, 5.0, 6.0));
    odometry.T_world_sensor = T_odom_base * T_base_sensor;
    const Eigen::Vector3d base_velocity(1.0, 0.2, 0.0);
    const Eigen::Vector3d turn(0.0, 0.0, 0.7);
    const Eigen::Vector3d sensor_velocity_in_base = base_velocity + turn.cross(T_base_sensor.translation());
    odometry.linear_velocity_mps = T_base_sensor.linear().transpose() * sensor_velocity_in_base;
    odometry.angular_velocity_radps = T_base_sensor.linear().transpose() * turn;
    RecordingBus bus;
    PosePublisher publisher(bus, T_base_sensor, {});
    publisher.publish(frame, 1);
    const auto pose = bus.decoded<pose_t>("DLOD_POSE").at(0);
    EXPECT_NEAR(pose.position[0], 4.0, 1e-9);
    EXPECT_NEAR(pose.position[1], 5.0, 1e-9);
    EXPECT_NEAR(pose.position[2], 6.0, 1e-9);
    EXPECT_NEAR(pose.orientation[0], std::cos(0.15), 1e-9) << "w first";
    EXPECT_NEAR(pose.orientation[3], std::sin(0.15), 1e-9);
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(pose.linear_velocity[i], base_velocity[i], 1e-9);
        EXPECT_NEAR(pose.angular_velocity[i], turn[i], 1e-9);
    }
    EXPECT_EQ(pose.flags, +pose_t::VALID + +pose_t::IMU_USED + +pose_t::PREDICTED_ONLY);
}

TEST(PosePublisher, BotCorePosesAreThoseOfLibbotsStacks) {
    // The fingerprint that libbot's own pose_t has, as LCM puts it into a message.
    EXPECT_EQ(static_cast<std::uint64_t>(bot_core::pose_t::getHash()), 0x2e16efb052b0105eULL);
    Frame frame(test::small_sensor());
    auto& odometry = frame.odometry;
    odometry.valid = true;
    odometry.T_world_sensor = make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, M_PI / 2)), Eigen::Vector3d(1.0, 2.0, 3.0));
    odometry.linear_velocity_mps = Eigen::Vector3d(0.5, 0.0, 0.0);
    odometry.angular_velocity_radps = Eigen::Vector3d(0.1, 0.2, 0.3);
    RecordingBus bus;
    LcmConfig config;
    config.bot_core_channel = "POSE";
    PosePublisher publisher(bus, Eigen::Isometry3d::Identity(), config);
    publisher.publish(frame, 42);
    odometry.valid = false;
    publisher.publish(frame, 43);
    const auto poses = bus.decoded<bot_core::pose_t>("POSE");
    ASSERT_EQ(poses.size(), 1U) << "a pose that is not valid cannot be told by its fields, so it is not sent";
    const auto& pose = poses[0];
    EXPECT_EQ(pose.utime, 42);
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(pose.pos[i], i + 1.0, 1e-12);
        EXPECT_NEAR(pose.vel[i], i == 1 ? 0.5 : 0.0, 1e-12) << "in odom's axes";
        EXPECT_NEAR(pose.rotation_rate[i], 0.1 * (i + 1), 1e-12) << "in the base's axes";
        EXPECT_EQ(pose.accel[i], 0.0);
    }
    EXPECT_NEAR(pose.orientation[0], std::sqrt(0.5), 1e-12) << "w first";
    EXPECT_NEAR(pose.orientation[3], std::sqrt(0.5), 1e-12);
}

TEST(PosePublisher, TheCovarianceIsMovedToTheBase) {
    // Sampled: a sensor pose with small errors, and what that makes of the base's position.
    OdometryResult odometry;
    odometry.T_world_sensor = make_pose(so3_exp(Eigen::Vector3d(0.1, 0.2, 1.0)), Eigen::Vector3d(1.0, 2.0, 3.0));
    const Eigen::Isometry3d T_base_sensor =
        make_pose(so3_exp(Eigen::Vector3d(0.0, 0.1, -0.4)), Eigen::Vector3d(0.6, -0.2, 1.1));
    Vector6d sigma;
    sigma << 0.01, 0.02, 0.03, 0.004, 0.002, 0.003;
    odometry.covariance = sigma.cwiseAbs2().asDiagonal();
    const BaseMotion motion = base_motion(odometry.motion(), T_base_sensor);
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    Matrix6d sampled = Matrix6d::Zero();
    constexpr int kSamples = 40'000;
    for (int i = 0; i < kSamples; ++i) {
        Vector6d error;
        for (int k = 0; k < 6; ++k) error[k] = sigma[k] * normal(random);
        Eigen::Isometry3d T = odometry.T_world_sensor;
        T.translation() += error.head<3>();
        T.linear() = so3_exp(error.tail<3>()).toRotationMatrix() * T.linear();
        const Eigen::Isometry3d base = T * T_base_sensor.inverse();
        Vector6d delta;
        delta << base.translation() - motion.T_odom_base.translation(),
            so3_log(Eigen::Quaterniond(base.linear() * motion.T_odom_base.linear().transpose()));
        sampled += delta * delta.transpose() / kSamples;
    }
    EXPECT_LT((sampled - motion.covariance).norm(), 0.03 * motion.covariance.norm());
}

TEST(PosePublisher, AMessageThatIsNotSentIsCounted) {
    const Frame frame(test::small_sensor());
    RecordingBus bus;
    bus.accepts = false;
    PosePublisher publisher(bus, Eigen::Isometry3d::Identity(), {});
    publisher.publish(frame, 1);
    EXPECT_EQ(publisher.failed(), 1U);
    EXPECT_EQ(bus.messages.size(), 1U) << "bot_core's pose is off by default";
}

}  // namespace
}  // namespace dlod::daemon
