#include "core/odometry/motion_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

namespace dlod {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
const Eigen::Vector3d kGravity(0.0, 0.0, -9.80665);

/// The sensor's pose in the world on a curved, tilting path.
Eigen::Isometry3d path(double t) {
    return make_pose(so3_exp(Eigen::Vector3d(0.05 * std::sin(2.0 * t), 0.04 * std::cos(1.7 * t), 0.6 * t)),
                     Eigen::Vector3d(1.2 * t + 0.2 * std::sin(3.0 * t), 0.5 * std::cos(t), 0.1 * std::sin(2.0 * t)));
}

Eigen::Isometry3d sensor_in_body() {
    return make_pose(so3_exp(Eigen::Vector3d(0.1, -0.2, 3.0)), Eigen::Vector3d(-0.01, 0.02, 0.04));
}

/// What the IMU, which is the body, reads on the path without noise.
void feed(ImuBuffer& buffer, double from_s, double to_s) {
    const auto body = [](double t) { return path(t) * sensor_in_body().inverse(); };
    std::vector<ImuSample> samples;
    constexpr double h = 1e-4;
    for (double t = from_s; t < to_s; t += 0.005) {
        const Eigen::Isometry3d before = body(t - h), now = body(t), after = body(t + h);
        ImuSample s;
        s.stamp_ns = std::llround(t * 1e9);
        s.angular_velocity_radps =
            (so3_log(Eigen::Quaterniond(before.rotation().transpose() * after.rotation())) / (2.0 * h)).cast<float>();
        const Eigen::Vector3d acceleration =
            (after.translation() - 2.0 * now.translation() + before.translation()) / (h * h);
        s.acceleration_mps2 = (now.rotation().transpose() * (acceleration - kGravity)).cast<float>();
        samples.push_back(s);
    }
    buffer.add(samples);
}

Eigen::Vector3d body_velocity(double t) {
    constexpr double h = 1e-5;
    const Eigen::Isometry3d T_sensor_body = sensor_in_body().inverse();
    return ((path(t + h) * T_sensor_body).translation() - (path(t - h) * T_sensor_body).translation()) / (2.0 * h);
}

class MotionFilterTest : public testing::Test {
  protected:
    void start(const ImuBuffer* readings) {
        filter.initialize(path(1.0), kGravity, kSecond_ns, readings);
        filter.set_motion(body_velocity(1.0), filter.state().rate_radps);
    }
    static double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
        return (a.translation() - b.translation()).norm();
    }
    static double angle(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
        return so3_log(Eigen::Quaterniond(a.rotation().transpose() * b.rotation())).norm();
    }

    ImuBuffer imu;
    MotionFilter filter{MotionFilterConfig{}, sensor_in_body()};
};

TEST_F(MotionFilterTest, StartsWhereItIsTold) {
    start(nullptr);
    EXPECT_LT(distance(filter.T_world_sensor(), path(1.0)), 1e-12);
    EXPECT_LT(angle(filter.T_world_sensor(), path(1.0)), 1e-9);
    EXPECT_EQ(filter.stamp_ns(), kSecond_ns);
    EXPECT_FALSE(filter.uses_imu());
}

TEST_F(MotionFilterTest, WithTheImuItFollowsTheTrueMotion) {
    feed(imu, 0.5, 2.5);
    start(&imu);
    for (int k = 1; k <= 10; ++k) filter.predict(kSecond_ns + k * kSecond_ns / 10);
    EXPECT_LT(distance(filter.T_world_sensor(), path(2.0)), 2e-3);
    EXPECT_LT(angle(filter.T_world_sensor(), path(2.0)), 2e-4);
    // Velocities are those of the sensor, not of the body beside it.
    constexpr double h = 1e-5;
    const Eigen::Vector3d velocity =
        path(2.0).rotation().transpose() * (path(2.0 + h).translation() - path(2.0 - h).translation()) / (2.0 * h);
    EXPECT_LT((filter.sensor_linear_velocity() - velocity).norm(), 5e-3);
    const Eigen::Vector3d rate =
        so3_log(Eigen::Quaterniond(path(2.0 - h).rotation().transpose() * path(2.0 + h).rotation())) / (2.0 * h);
    EXPECT_LT((filter.sensor_angular_velocity() - rate).norm(), 2e-3);
}

TEST_F(MotionFilterTest, OnePredictionIsAsGoodAsMany) {
    feed(imu, 0.5, 2.5);
    start(&imu);
    MotionFilter once = filter;
    for (int k = 1; k <= 7; ++k) filter.predict(kSecond_ns + k * kSecond_ns / 10);
    once.predict(kSecond_ns + 7 * kSecond_ns / 10);
    EXPECT_LT(distance(once.T_world_sensor(), filter.T_world_sensor()), 1e-9);
    EXPECT_LT((once.covariance() - filter.covariance()).norm(), 1e-6 * filter.covariance().norm());
    // The past does not change it.
    const Eigen::Isometry3d before = once.T_world_sensor();
    once.predict(kSecond_ns);
    EXPECT_EQ(once.T_world_sensor().matrix(), before.matrix());
}

TEST_F(MotionFilterTest, WithoutTheImuItGoesOnInAnArc) {
    filter = MotionFilter(MotionFilterConfig{}, Eigen::Isometry3d::Identity());
    filter.initialize(Eigen::Isometry3d::Identity(), kGravity, kSecond_ns, nullptr);
    filter.set_motion({2.0, 0.0, 0.0}, {0.0, 0.0, 0.5});
    filter.predict(2 * kSecond_ns);
    const double radius_m = 2.0 / 0.5;
    const Eigen::Vector3d expected(radius_m * std::sin(0.5), radius_m * (1.0 - std::cos(0.5)), 0.0);
    EXPECT_LT((filter.T_world_sensor().translation() - expected).norm(), 1e-3);
    EXPECT_LT(angle(filter.T_world_sensor(), make_pose(so3_exp({0, 0, 0.5}), {0, 0, 0})), 1e-6);
    EXPECT_LT((filter.sensor_linear_velocity() - Eigen::Vector3d(2.0, 0.0, 0.0)).norm(), 1e-3);
}

TEST_F(MotionFilterTest, TheSweepGoesBackAlongTheTrueMotion) {
    feed(imu, 0.5, 2.5);
    start(&imu);
    filter.predict(kSecond_ns + 4 * kSecond_ns / 10);
    SweepMotion motion;
    const Eigen::Vector3d origin_m(1.0, 0.5, -2.0);
    filter.sweep(0.1, origin_m, motion);
    EXPECT_FLOAT_EQ(motion.duration_s, 0.1F);
    for (int k = 0; k < SweepMotion::kKnots; ++k) {
        Eigen::Isometry3d expected = path(1.4 + static_cast<double>(motion.time_of(k)));
        expected.translation() -= origin_m;
        for (int i = 0; i < 12; ++i)
            EXPECT_NEAR(static_cast<double>(motion.rows[k][i]), expected.matrix()(i / 4, i % 4), 1e-3) << k << ' ' << i;
    }
}

TEST_F(MotionFilterTest, UncertaintyGrowsAndStaysACovariance) {
    feed(imu, 0.5, 8.0);
    for (const ImuBuffer* readings : {static_cast<const ImuBuffer*>(&imu), static_cast<const ImuBuffer*>(nullptr)}) {
        start(readings);
        double before = 0.0;
        for (int k = 1; k <= 50; ++k) {
            filter.predict(kSecond_ns + k * kSecond_ns / 10);
            const Matrix6d covariance = filter.pose_covariance();
            EXPECT_LT((covariance - covariance.transpose()).norm(), 1e-9 * covariance.norm());
            EXPECT_GT(covariance.trace(), before);
            before = covariance.trace();
            const Eigen::SelfAdjointEigenSolver<MotionFilter::Matrix> solver(filter.covariance());
            EXPECT_GT(solver.eigenvalues()[0], -1e-12 * solver.eigenvalues()[MotionFilter::kStates - 1]);
        }
    }
}

TEST_F(MotionFilterTest, ADiscardedUpdateLeavesThePrediction) {
    feed(imu, 0.5, 2.5);
    start(&imu);
    filter.predict(kSecond_ns + kSecond_ns / 10);
    const Eigen::Isometry3d predicted = filter.T_world_sensor();
    filter.begin_update();
    EXPECT_EQ(filter.correction().norm(), 0.0);
    filter.set_motion({1.0, 2.0, 3.0}, {0.1, 0.2, 0.3});
    EXPECT_GT(filter.correction().norm(), 0.0);
    filter.discard_update();
    EXPECT_EQ(filter.T_world_sensor().matrix(), predicted.matrix());
    EXPECT_EQ(filter.correction().norm(), 0.0);
}

TEST_F(MotionFilterTest, ChangingTheModelKeepsPoseAndVelocity) {
    feed(imu, 0.5, 2.5);
    start(&imu);
    filter.predict(kSecond_ns + kSecond_ns / 2);
    const Eigen::Isometry3d pose = filter.T_world_sensor();
    const Eigen::Vector3d linear = filter.sensor_linear_velocity(), angular = filter.sensor_angular_velocity();
    filter.use_imu(nullptr);
    EXPECT_EQ(filter.T_world_sensor().matrix(), pose.matrix());
    EXPECT_LT((filter.sensor_linear_velocity() - linear).norm(), 1e-9);
    EXPECT_LT((filter.sensor_angular_velocity() - angular).norm(), 1e-9);
    filter.use_imu(&imu);
    EXPECT_EQ(filter.T_world_sensor().matrix(), pose.matrix());
    EXPECT_TRUE(filter.uses_imu());
}

}  // namespace
}  // namespace dlod
