#include "daemon/publish/predicted_pose_publisher.hpp"

#include <gtest/gtest.h>

#include "core/types/lie.hpp"
#include "tests/support/recording_bus.hpp"
#include "tests/support/synthetic_frame.hpp"

namespace dlod::daemon {
namespace {

using test::RecordingBus;

constexpr std::int64_t kUtime = 1'700'000'000'000'000;

/// A robot that drives ahead at 1 m/s on the level; the sensor sits 2 m above its base.
class PredictedPoseTest : public ::testing::Test {
  protected:
    PredictedPoseTest() : frame(test::small_sensor()) {
        config.predicted_pose_every = 1;
        T_base_sensor.translation() = Eigen::Vector3d(0.0, 0.0, 2.0);
        frame.header.stamp_ns = 1'000'000'000;
        frame.header.sequence = 7;
        frame.odometry.valid = true;
        frame.odometry.flags = OdometryResult::kImuUsed;
        frame.odometry.T_world_sensor.translation() = Eigen::Vector3d(5.0, 0.0, 2.0);
        frame.odometry.linear_velocity_mps = Eigen::Vector3d(1.0, 0.0, 0.0);
    }
    PredictedPosePublisher publisher() {
        return {bus, test::small_sensor(), MotionFilterConfig{}, T_base_sensor, config};
    }
    static ImuSample reading(std::int64_t time_ns) {
        ImuSample sample;
        sample.stamp_ns = time_ns;
        sample.acceleration_mps2 = Eigen::Vector3f(0.0F, 0.0F, 9.80665F);
        return sample;
    }
    std::vector<pose_t> messages() { return bus.decoded<pose_t>("DLOD_POSE_PREDICTED"); }

    LcmConfig config;
    Eigen::Isometry3d T_base_sensor = Eigen::Isometry3d::Identity();
    Frame frame;
    RecordingBus bus;
};

TEST_F(PredictedPoseTest, AMessageForEachReadingAfterThePose) {
    PredictedPosePublisher poses = publisher();
    poses.publish(reading(990'000'000));
    EXPECT_TRUE(messages().empty()) << "no pose yet";
    poses.see(frame, kUtime);
    for (int i = 0; i < 5; ++i) poses.publish(reading(1'000'000'000 + 10'000'000 * i));
    ASSERT_EQ(messages().size(), 4U) << "the reading at the pose's own time adds nothing";
    const pose_t pose = messages().back();
    EXPECT_EQ(pose.utime, kUtime + 40'000);
    EXPECT_EQ(pose.sequence, 7);
    EXPECT_NEAR(pose.position[0], 5.04, 1e-6);
    EXPECT_NEAR(pose.position[2], 0.0, 1e-6) << "of the base";
    EXPECT_NEAR(pose.linear_velocity[0], 1.0, 1e-6);
    EXPECT_EQ(pose.flags, +pose_t::VALID + +pose_t::IMU_USED + +pose_t::PREDICTED_ONLY);
}

TEST_F(PredictedPoseTest, EveryNthReadingOrNone) {
    config.predicted_pose_every = 3;
    PredictedPosePublisher third = publisher();
    third.see(frame, kUtime);
    for (int i = 1; i <= 12; ++i) third.publish(reading(1'000'000'000 + 10'000'000 * i));
    EXPECT_EQ(messages().size(), 4U);
    config.predicted_pose_every = 0;
    PredictedPosePublisher none = publisher();
    none.see(frame, kUtime);
    for (int i = 1; i <= 12; ++i) none.publish(reading(1'000'000'000 + 10'000'000 * i));
    EXPECT_EQ(messages().size(), 4U);
}

TEST_F(PredictedPoseTest, AnInvalidPoseOrOneWithoutImuEndsThem) {
    for (const bool valid : {false, true}) {
        PredictedPosePublisher poses = publisher();
        frame.odometry.valid = true;
        frame.odometry.flags = OdometryResult::kImuUsed;
        poses.see(frame, kUtime);
        poses.publish(reading(1'010'000'000));
        const std::size_t before = messages().size();
        EXPECT_GT(before, 0U);
        frame.odometry.valid = valid;
        frame.odometry.flags = valid ? 0U : OdometryResult::kImuUsed;
        poses.see(frame, kUtime);
        poses.publish(reading(1'020'000'000));
        EXPECT_EQ(messages().size(), before) << valid;
    }
}

TEST_F(PredictedPoseTest, TimeDoesNotGoBack) {
    PredictedPosePublisher poses = publisher();
    poses.see(frame, kUtime);
    poses.publish(reading(1'090'000'000));
    frame.header.stamp_ns = 1'085'000'000;
    poses.see(frame, kUtime + 78'000);  // 7 ms earlier than by the frame before
    poses.publish(reading(1'091'000'000));
    ASSERT_EQ(messages().size(), 2U);
    EXPECT_GE(messages()[1].utime, messages()[0].utime);
}

TEST_F(PredictedPoseTest, TimeFollowsASensorThatStartsAnew) {
    PredictedPosePublisher poses = publisher();
    poses.see(frame, 3'600'000'000);
    poses.publish(reading(1'010'000'000));
    // Its clock counts from the start, and utime is the sensor's.
    for (const std::int64_t start_ms : {100, 200}) {
        frame.header.stamp_ns = 1'000'000 * start_ms;
        poses.see(frame, 1000 * start_ms);
        for (int i = 1; i <= 10; ++i) poses.publish(reading(1'000'000 * (start_ms + 10 * i)));
    }
    ASSERT_GT(messages().size(), 10U);
    EXPECT_EQ(messages().back().utime, 300'000);
}

}  // namespace
}  // namespace dlod::daemon
