#include "core/tracking/kalman_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <numbers>
#include <random>

namespace dlod {
namespace {

constexpr double kPi = std::numbers::pi;

BoxMeasurement measure(const Eigen::Vector3d& center, double yaw, double age_s = 0.0) {
    BoxMeasurement m;
    m.box.center_m = center;
    m.box.yaw_rad = yaw;
    m.box.size_m = {0.8, 0.5, 1.7};
    m.age_s = age_s;
    m.plane_covariance = 0.05 * 0.05 * Eigen::Matrix2d::Identity();
    m.z_sd_m = 0.05;
    return m;
}

TEST(KalmanFilter, LearnsAConstantVelocityOverUnevenSteps) {
    const KalmanConfig config;
    const Eigen::Vector3d start(1, 2, 0.9), velocity(1.2, -0.7, 0.0);
    KalmanFilter filter(measure(start, 0.0), config);
    double t = 0.0;
    for (int i = 0; i < 30; ++i) {
        const double dt = i % 7 == 3 ? 0.3 : 0.1;  // lost frames
        t += dt;
        filter.predict(dt, config);
        filter.update(measure(start + t * velocity, 0.0), config);
    }
    EXPECT_LT((filter.velocity() - velocity).norm(), 0.02);
    EXPECT_LT((filter.box().center_m - (start + t * velocity)).norm(), 0.01);
}

TEST(KalmanFilter, OldPointsAreBroughtToTheStamp) {
    const KalmanConfig config;
    const Eigen::Vector3d velocity(20.0, 0.0, 0.0);  // a vehicle
    KalmanFilter filter(measure(Eigen::Vector3d::Zero(), 0.0), config);
    for (int i = 1; i <= 30; ++i) {
        const double stamp = 0.1 * i;
        const double age = i % 2 == 0 ? 0.09 : 0.01;
        filter.predict(0.1, config);
        filter.update(measure((stamp - age) * velocity, 0.0, age), config);
    }
    // Without the age the centre would lag by up to 1.8 m.
    EXPECT_NEAR(filter.box().center_m.x(), 60.0, 0.1);
    EXPECT_NEAR(filter.velocity().x(), 20.0, 0.1);
}

TEST(KalmanFilter, TheSignOfAPrincipalAxisNeverTurnsTheYaw) {
    const KalmanConfig config;
    KalmanFilter filter(measure(Eigen::Vector3d::Zero(), 3.1), config);
    for (int i = 0; i < 20; ++i) {
        filter.predict(0.1, config);
        filter.update(measure(Eigen::Vector3d::Zero(), i % 2 == 0 ? 3.1 : 3.1 - kPi), config);
        EXPECT_NEAR(std::remainder(filter.box().yaw_rad - 3.1, 2.0 * kPi), 0.0, 1e-6);
    }
}

TEST(KalmanFilter, YawWrapsAroundPi) {
    const KalmanConfig config;
    KalmanFilter filter(measure(Eigen::Vector3d::Zero(), 3.1), config);
    for (int i = 1; i <= 10; ++i) {
        filter.predict(0.1, config);
        filter.update(measure(Eigen::Vector3d::Zero(), 3.1 + 0.02 * i), config);
    }
    EXPECT_LE(std::abs(filter.box().yaw_rad), kPi);
    EXPECT_NEAR(std::remainder(filter.box().yaw_rad - 3.3, 2.0 * kPi), 0.0, 0.05);
}

TEST(KalmanFilter, AxesAreAlignedWithoutMovingTheFootprint) {
    const KalmanConfig config;
    KalmanFilter filter(measure(Eigen::Vector3d::Zero(), 0.1), config);
    filter.align_axes(0.1 + kPi / 2 + 0.2);
    EXPECT_NEAR(filter.box().yaw_rad, 0.1 + kPi / 2, 1e-12);
    EXPECT_NEAR(filter.box().size_m.x(), 0.5, 1e-12);
    EXPECT_NEAR(filter.box().size_m.y(), 0.8, 1e-12);
    filter.align_axes(-2.9);
    EXPECT_NEAR(std::remainder(filter.box().yaw_rad - (0.1 + kPi), 2.0 * kPi), 0.0, 1e-12);
    EXPECT_NEAR(filter.box().size_m.x(), 0.8, 1e-12);
}

TEST(KalmanFilter, TheCovarianceStaysSymmetricAndPositive) {
    const KalmanConfig config;
    std::mt19937 random(5);
    std::normal_distribution<double> noise;
    std::uniform_real_distribution<double> u(0.0, 1.0);
    KalmanFilter filter(measure(Eigen::Vector3d::Zero(), 0.0), config);
    for (int i = 0; i < 2000; ++i) {
        filter.predict(0.2 * u(random), config);
        if (u(random) < 0.3) continue;
        BoxMeasurement m = measure(Eigen::Vector3d(noise(random), noise(random), 0.0), noise(random), 0.1 * u(random));
        m.plane_covariance *= 1e-4;  // far too sure
        m.size_sd_m = Eigen::Vector3d::Constant(u(random) < 0.5 ? 10.0 : 0.01);
        filter.update(m, config);
        const auto& P = filter.covariance();
        ASSERT_TRUE(P.allFinite());
        ASSERT_EQ((P - P.transpose()).cwiseAbs().maxCoeff(), 0.0);
        ASSERT_GT(Eigen::SelfAdjointEigenSolver<KalmanFilter::Covariance>(P).eigenvalues().minCoeff(), -1e-9);
    }
}

TEST(KalmanFilter, MatchesTheTextbookForm) {
    const KalmanConfig config;
    KalmanFilter filter(measure({1, 2, 3}, 0.4), config);
    filter.predict(0.1, config);
    const auto P = filter.covariance();
    const auto x = filter.state();
    BoxMeasurement m = measure({1.3, 1.9, 3.1}, 0.5, 0.04);
    filter.update(m, config);

    Eigen::Matrix<double, 7, 10> H = Eigen::Matrix<double, 7, 10>::Identity();
    for (int i = 0; i < 3; ++i) H(i, 7 + i) = -0.04;
    Eigen::Matrix<double, 7, 7> R = Eigen::Matrix<double, 7, 7>::Zero();
    R.diagonal() << 0.0025, 0.0025, 0.0025, 0.09, 0.01, 0.01, 0.01;
    Eigen::Matrix<double, 7, 1> z;
    z << 1.3, 1.9, 3.1, 0.5, 0.8, 0.5, 1.7;
    const Eigen::Matrix<double, 10, 7> K = P * H.transpose() * (H * P * H.transpose() + R).inverse();
    EXPECT_LT((filter.state() - (x + K * (z - H * x))).norm(), 1e-9);
    EXPECT_LT((filter.covariance() - (KalmanFilter::Covariance::Identity() - K * H) * P).norm(), 1e-9);
}

TEST(KalmanFilter, GrowthMovesTheMiddleButIsNoMotion) {
    const KalmanConfig config;
    BoxMeasurement m;
    m.box.center_m = {10.0, 0.0, 0.0};
    m.box.size_m = {2.0, 1.8, 1.5};
    KalmanFilter filter(m, config);
    filter.grow(3.0, 0.0, 0.0, 0.0);
    EXPECT_NEAR(filter.box().center_m.x(), 11.5, 1e-9);
    EXPECT_NEAR(filter.box().size_m.x(), 5.0, 1e-9);
    EXPECT_NEAR(filter.speed(), 0.0, 1e-9);
    // It proves to be shorter: the end that did not move stays where it was.
    filter.predict(0.1, config);
    BoxMeasurement shorter = m;
    shorter.plane_covariance = 100.0 * Eigen::Matrix2d::Identity();
    shorter.box.size_m.x() = 4.0;
    shorter.size_sd_m.x() = 0.01;
    shorter.box.center_m.x() = 11.0;
    filter.update(shorter, config);
    EXPECT_NEAR(filter.box().size_m.x(), 4.0, 0.05);
    EXPECT_NEAR(filter.box().center_m.x() - 0.5 * filter.box().size_m.x(), 9.0, 0.1);
}

TEST(KalmanFilter, AMeasuredVelocityIsTakenInByItsCovariance) {
    const KalmanConfig config;
    BoxMeasurement m;
    KalmanFilter filter(m, config);
    filter.update_velocity({8.0, 1.0}, Eigen::Vector2d(0.01, 1e6).asDiagonal());
    EXPECT_NEAR(filter.velocity().x(), 8.0, 0.1);
    EXPECT_NEAR(filter.velocity().y(), 0.0, 0.1);
}

}  // namespace
}  // namespace dlod
