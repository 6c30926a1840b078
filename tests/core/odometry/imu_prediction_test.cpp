#include "core/odometry/imu_prediction.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/types/lie.hpp"

namespace dlod {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kReading_ns = 10'000'000;
constexpr double kSpeed_mps = 2.0;
constexpr double kTurn_radps = 0.8;

/// A sensor that drives in a circle, its x axis ahead; the IMU sits beside it, turned and with biases.
class ImuPredictionTest : public ::testing::Test {
  protected:
    ImuPredictionTest()
        : T_sensor_imu(make_pose(so3_exp(Eigen::Vector3d(0.1, -0.2, 1.5)), Eigen::Vector3d(0.05, -0.1, 0.2))),
          prediction(T_sensor_imu, MotionFilterConfig{}) {
        correction.gyro_bias_radps = {0.02, -0.01, 0.03};
        correction.accelerometer_bias_mps2 = {0.1, 0.2, -0.15};
        correction.velocity_covariance.diagonal().setConstant(0.04);
    }
    static SensorMotion truth(std::int64_t time_ns) {
        const double angle = kTurn_radps * 1e-9 * static_cast<double>(time_ns);
        const double radius_m = kSpeed_mps / kTurn_radps;
        SensorMotion motion;
        motion.T_world_sensor = make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, angle)),
                                          radius_m * Eigen::Vector3d(std::sin(angle), 1.0 - std::cos(angle), 0.0));
        motion.linear_velocity_mps = {kSpeed_mps, 0.0, 0.0};
        motion.angular_velocity_radps = {0.0, 0.0, kTurn_radps};
        motion.covariance.diagonal().setConstant(1e-4);
        return motion;
    }
    /// What the IMU feels then.
    ImuSample reading(std::int64_t time_ns) const {
        const Eigen::Vector3d turn(0.0, 0.0, kTurn_radps);
        const Eigen::Vector3d arm = T_sensor_imu.translation();
        const Eigen::Vector3d free = kSpeed_mps * kTurn_radps * Eigen::Vector3d::UnitY() + turn.cross(turn.cross(arm));
        const Eigen::Vector3d force =
            free - truth(time_ns).T_world_sensor.linear().transpose() * correction.gravity_mps2;
        const Eigen::Matrix3d R_imu_sensor = T_sensor_imu.linear().transpose();
        ImuSample sample;
        sample.stamp_ns = time_ns;
        sample.angular_velocity_radps = (R_imu_sensor * turn + correction.gyro_bias_radps).cast<float>();
        sample.acceleration_mps2 = (R_imu_sensor * force + correction.accelerometer_bias_mps2).cast<float>();
        return sample;
    }
    void read(std::int64_t from_ns, std::int64_t to_ns) {
        for (std::int64_t t = from_ns; t <= to_ns; t += kReading_ns) prediction.add(reading(t));
    }
    void begin(std::int64_t time_ns) { prediction.begin(time_ns, truth(time_ns), correction); }
    void expect_truth(std::int64_t time_ns) const {
        ASSERT_EQ(prediction.stamp_ns(), time_ns);
        const auto motion = prediction.motion();
        ASSERT_TRUE(motion.has_value());
        const SensorMotion expected = truth(time_ns);
        const Eigen::Isometry3d error = expected.T_world_sensor.inverse() * motion->T_world_sensor;
        EXPECT_LT(error.translation().norm(), 1e-3);
        EXPECT_LT(Eigen::AngleAxisd(error.rotation()).angle(), 1e-4);
        EXPECT_LT((motion->linear_velocity_mps - expected.linear_velocity_mps).norm(), 5e-3);
        EXPECT_LT((motion->angular_velocity_radps - expected.angular_velocity_radps).norm(), 1e-4);
    }

    Eigen::Isometry3d T_sensor_imu;
    ImuCorrection correction;
    ImuPrediction prediction;
};

TEST_F(ImuPredictionTest, CarriesThePoseOnReadingByReading) {
    begin(kSecond_ns);
    for (std::int64_t t = kSecond_ns; t <= kSecond_ns + 200'000'000; t += kReading_ns) {
        prediction.add(reading(t));
        if (t > kSecond_ns) expect_truth(t);
    }
}

TEST_F(ImuPredictionTest, APoseComesLaterThanTheReadingsAfterIt) {
    read(kSecond_ns - 100'000'000, kSecond_ns + 50'000'000);
    EXPECT_FALSE(prediction.motion().has_value());
    begin(kSecond_ns + 3'000'000);  // between two readings
    expect_truth(kSecond_ns + 50'000'000);
}

TEST_F(ImuPredictionTest, ANewPoseTakesThePlaceOfTheOldOne) {
    begin(0);
    read(0, 100'000'000);
    SensorMotion elsewhere = truth(90'000'000);
    elsewhere.T_world_sensor.pretranslate(Eigen::Vector3d(0.0, 0.0, 5.0));
    prediction.begin(90'000'000, elsewhere, correction);
    ASSERT_TRUE(prediction.motion().has_value());
    EXPECT_NEAR(prediction.motion()->T_world_sensor.translation().z(), 5.0, 1e-3);
}

TEST_F(ImuPredictionTest, UncertaintyGrowsWithTime) {
    begin(0);
    read(0, 50'000'000);
    const Matrix6d soon = prediction.motion()->covariance;
    read(60'000'000, 200'000'000);
    const Matrix6d later = prediction.motion()->covariance;
    for (int i = 0; i < 6; ++i) EXPECT_GT(later(i, i), soon(i, i)) << i;
    // A velocity that is known to .2 m/s, over .2 s.
    EXPECT_NEAR(later(0, 0), 1e-4 + 0.04 * 0.04, 1e-4);
}

TEST_F(ImuPredictionTest, NothingIsSaidWithoutReadingsWithoutAPoseOrTooLongAfterIt) {
    begin(0);
    EXPECT_FALSE(prediction.motion().has_value()) << "no reading yet";
    read(0, ImuPrediction::kMost_ns);
    EXPECT_TRUE(prediction.motion().has_value());
    prediction.add(reading(ImuPrediction::kMost_ns + kReading_ns));
    EXPECT_FALSE(prediction.motion().has_value()) << "too old";
    begin(ImuPrediction::kMost_ns);
    EXPECT_TRUE(prediction.motion().has_value());
    prediction.end();
    EXPECT_FALSE(prediction.motion().has_value());
}

TEST_F(ImuPredictionTest, NothingIsSaidAfterASilenceOfTheImu) {
    begin(0);
    read(0, 50'000'000);
    prediction.add(reading(350'000'000));
    EXPECT_FALSE(prediction.motion().has_value());
}

}  // namespace
}  // namespace dlod
