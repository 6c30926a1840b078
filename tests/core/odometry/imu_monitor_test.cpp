#include "core/odometry/imu_monitor.hpp"

#include <gtest/gtest.h>

#include <random>

namespace dlod {
namespace {

constexpr std::int64_t kFrame_ns = 100'000'000;
constexpr std::int64_t kSample_ns = 10'000'000;

ImuMonitor::Correction correction(double rotation_rad, double rotation_deviation_rad, double velocity_mps,
                                  double velocity_deviation_mps) {
    return {.rotation_rad = rotation_rad,
            .rotation_deviation_rad = rotation_deviation_rad,
            .velocity_mps = velocity_mps,
            .velocity_deviation_mps = velocity_deviation_mps};
}

class ImuMonitorTest : public testing::Test {
  protected:
    /// A frame's samples as a sensor that walks gives them.
    std::vector<ImuSample> walking() {
        std::vector<ImuSample> samples;
        for (int i = 0; i < 10; ++i) {
            ImuSample s;
            s.stamp_ns = time_ns_ += kSample_ns;
            s.acceleration_mps2 = Eigen::Vector3f(gauss(0.5F), gauss(0.5F), 9.8F + gauss(0.5F));
            s.angular_velocity_radps = Eigen::Vector3f(gauss(0.1F), gauss(0.1F), gauss(0.1F));
            samples.push_back(s);
        }
        return samples;
    }
    /// One frame in which all samples but `refused` are accepted.
    void see(const std::vector<ImuSample>& samples, int refused = 0) {
        stamp_ns_ += kFrame_ns;
        const int taken = static_cast<int>(samples.size()) - refused;
        if (taken > 0) newest_ns_ = samples.back().stamp_ns;
        monitor.see_samples(samples, taken, newest_ns_, stamp_ns_);
    }
    /// Frames until the IMU is taken back while gyroscope and lidar agree.
    int frames_until_usable() {
        for (int frames = 1; frames < 2000; ++frames) {
            see(walking());
            monitor.see_motion({0.001, 0.0, -0.001}, 0.3);
            if (monitor.usable()) return frames;
        }
        return -1;
    }
    void lose_samples_for_a_second() {
        for (int i = 0; i < 10; ++i) {
            time_ns_ += 10 * kSample_ns;
            see({});
        }
    }

    ImuMonitor monitor;

  private:
    float gauss(float deviation) { return deviation * normal_(random_); }

    std::mt19937 random_{3};
    std::normal_distribution<float> normal_;
    std::int64_t time_ns_ = 0, stamp_ns_ = 0, newest_ns_ = 0;
};

TEST_F(ImuMonitorTest, WithoutAnySampleThereIsNoImuAndNoFault) {
    for (int i = 0; i < 50; ++i) see({});
    EXPECT_FALSE(monitor.usable());
    EXPECT_FALSE(monitor.faulty());
}

TEST_F(ImuMonitorTest, GoodSamplesAreBelievedAtOnce) {
    for (int i = 0; i < 200; ++i) {
        see(walking());
        EXPECT_TRUE(monitor.usable());
        EXPECT_TRUE(monitor.see_correction(correction(1e-4, 1e-3, 0.01, 0.02)));
    }
}

TEST_F(ImuMonitorTest, SilenceStuckReadingsAndRefusedOnesAreFaults) {
    see(walking());
    see({});  // a tenth of a second is no silence yet, two are
    EXPECT_TRUE(monitor.usable());
    lose_samples_for_a_second();
    EXPECT_TRUE(monitor.faulty());

    monitor = ImuMonitor();
    see(walking());
    std::vector<ImuSample> stuck = walking();
    for (ImuSample& s : stuck) {
        s.acceleration_mps2 = stuck[0].acceleration_mps2;
        s.angular_velocity_radps = stuck[0].angular_velocity_radps;
    }
    see(stuck);
    EXPECT_TRUE(monitor.faulty());

    monitor = ImuMonitor();
    see(walking());
    see(walking(), 1);
    EXPECT_TRUE(monitor.usable());
    see(walking(), 2);
    EXPECT_TRUE(monitor.faulty());
}

TEST_F(ImuMonitorTest, AFaultPassesAfterAWhileTwiceAsLongEachTime) {
    see(walking());
    int before = 0;
    for (int fault = 0; fault < 4; ++fault) {
        lose_samples_for_a_second();
        ASSERT_TRUE(monitor.faulty());
        const int frames = frames_until_usable();
        ASSERT_GT(frames, 10);
        if (before > 0) {
            EXPECT_EQ(frames, 2 * before);
        }
        before = frames;
    }
}

TEST_F(ImuMonitorTest, ItIsNotTakenBackWhileItDisagreesWithTheLidar) {
    see(walking());
    monitor.blame();
    for (int i = 0; i < 500; ++i) {
        see(walking());
        if (i % 2 == 0) {
            monitor.see_motion({0.1, 0.0, -0.1}, 0.0);
        } else {
            monitor.see_motion({0.0, 0.0, 0.0}, 5.0);
        }
        ASSERT_FALSE(monitor.usable());
    }
    EXPECT_GT(frames_until_usable(), 0);
}

TEST_F(ImuMonitorTest, ACorrectionIsImpossibleOnlyBeyondBothItsDeviationAndItsBound) {
    see(walking());
    // Large, but the prediction did not claim to know.
    EXPECT_TRUE(monitor.see_correction(correction(0.05, 0.1, 3.0, 3.0)));
    // Many deviations, but a hair.
    EXPECT_TRUE(monitor.see_correction(correction(0.002, 1e-5, 0.05, 1e-4)));
    EXPECT_TRUE(monitor.usable());
    EXPECT_FALSE(monitor.see_correction(correction(0.05, 1e-3, 0, 1.0)));
    EXPECT_TRUE(monitor.faulty());

    monitor = ImuMonitor();
    see(walking());
    EXPECT_FALSE(monitor.see_correction(correction(0, 1e-3, 2.0, 0.01)));
    EXPECT_TRUE(monitor.faulty());
}

TEST_F(ImuMonitorTest, APositionThatTheAccelerometerCanNotHaveMissedIsImpossible) {
    see(walking());
    EXPECT_TRUE(monitor.see_correction({.position_m = 0.03, .position_deviation_m = 1e-3}));
    EXPECT_TRUE(monitor.see_correction({.position_m = 0.2, .position_deviation_m = 0.1}));
    EXPECT_FALSE(monitor.see_correction({.position_m = 0.1, .position_deviation_m = 0.01}));
    EXPECT_TRUE(monitor.faulty());
}

TEST_F(ImuMonitorTest, SuspiciousCorrectionsAddUp) {
    see(walking());
    int frames = 0;
    while (monitor.see_correction(correction(0.027, 1e-3, 0, 1.0)) && frames < 100) ++frames;
    EXPECT_GT(frames, 1);
    EXPECT_LT(frames, 20);
    EXPECT_TRUE(monitor.faulty());

    monitor = ImuMonitor();
    see(walking());
    for (int i = 0; i < 200; ++i) {
        // One in ten is no pattern.
        const double rotation = i % 10 == 0 ? 0.027 : 1e-4;
        EXPECT_TRUE(monitor.see_correction(correction(rotation, 1e-3, 0, 1.0)));
    }
    EXPECT_TRUE(monitor.usable());
}

}  // namespace
}  // namespace dlod
