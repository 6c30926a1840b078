// What happens to frames and clocks, and that nothing is given as good that is not.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/odometry_run.hpp"

namespace dlod::test {
namespace {

constexpr std::uint32_t kReinitialized = OdometryResult::kReinitialized;

/// Straight on at 1.5 m/s, turning slowly.
Eigen::Isometry3d drive_on(double t) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(-4.0 + 1.5 * t, 0.05 * std::sin(6.0 * t), 0.0);
    T.linear() = Eigen::AngleAxisd(0.2 * t, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T;
}

void move_clock(Frame& frame, std::int64_t offset_ns) {
    frame.header.stamp_ns += offset_ns;
    frame.header.first_stamp_ns += offset_ns;
    for (std::int64_t& time : frame.columns.time_ns) time += time != 0 ? offset_ns : 0;
}

/// Ranges that belong to nothing.
void fill_with_noise(Frame& frame) {
    std::mt19937 random(5);
    std::uniform_int_distribution<std::uint32_t> range(1000, 30000);
    for (std::size_t i = 0; i < frame.raw.range_mm.size(); ++i) {
        if (frame.raw.range_mm[i] == 0) continue;
        const std::uint32_t r = range(random);
        const float factor = static_cast<float>(r) / static_cast<float>(frame.raw.range_mm[i]);
        frame.raw.range_mm[i] = r;
        for (auto* image : {&frame.cloud.range_m, &frame.cloud.x, &frame.cloud.y, &frame.cloud.z}) {
            (*image)[i] *= factor;
        }
    }
}

// Frame from which on the level is known after a bad first one, in motion.
constexpr std::size_t kLevelled = 8;

void expect_good_from(const OdometryRun& run, std::size_t first) {
    for (std::size_t i = first; i < run.frames.size(); ++i) {
        EXPECT_TRUE(run.frames[i].valid) << i;
        EXPECT_LT(run.relative_error(first, i).translation().norm(), 0.05) << i;
    }
}

class FirstFrame : public testing::TestWithParam<bool> {};

TEST_P(FirstFrame, OfNoiseIsNotValid) {
    SimulatedDrive drive(furnished_room(), drive_on);
    drive.spoil_frame = [](int k, Frame& frame) {
        if (k == 0) fill_with_noise(frame);
    };
    OdometryConfig config;
    config.use_imu = GetParam();
    OdometryRun run(drive, config);
    run.run(0, 20);
    EXPECT_FALSE(run.frames[0].valid);
    expect_good_from(run, GetParam() ? kLevelled : 3);
}

TEST_P(FirstFrame, ThatIsNearlyEmptyIsNotValid) {
    SimulatedDrive drive(furnished_room(), drive_on);
    drive.spoil_frame = [](int k, Frame& frame) {
        if (k > 0) return;
        for (std::size_t i = 0; i < frame.raw.range_mm.size(); ++i) {
            if (i % 97 == 0) continue;
            frame.raw.range_mm[i] = 0;
            for (auto* image : {&frame.cloud.range_m, &frame.cloud.x, &frame.cloud.y, &frame.cloud.z}) {
                (*image)[i] = 0.0F;
            }
        }
    };
    OdometryConfig config;
    config.use_imu = GetParam();
    OdometryRun run(drive, config);
    run.run(0, 20);
    EXPECT_FALSE(run.frames[0].valid);
    expect_good_from(run, GetParam() ? kLevelled : 3);
}

INSTANTIATE_TEST_SUITE_P(Odometry, FirstFrame, testing::Bool());

// What its scan sees is good for seeing what moves all the same.
TEST(WithoutImu, TheFirstPoseIsInDoubtUntilTheNextScanFits) {
    SimulatedDrive drive(furnished_room(), drive_on);
    OdometryConfig config;
    config.use_imu = false;
    OdometryRun run(drive, config);
    run.step(0);
    EXPECT_FALSE(run.frame().odometry.valid);
    EXPECT_TRUE(run.frame().odometry.in_doubt);
    EXPECT_TRUE(run.frame().odometry.follows_map());
    run.step(1);
    EXPECT_TRUE(run.frame().odometry.valid);
    EXPECT_FALSE(run.frame().odometry.in_doubt);
}

// The motion of a start is known by the next scan; where that does not fit, the world begins later.
TEST(WithoutImu, TheFirstPoseIsNotValidBeforeTheNextScanFits) {
    SimulatedDrive drive(furnished_room(), [](double t) { return drive_on(t < 0.105 ? t + 3.0 : t); });
    OdometryConfig config;
    config.use_imu = false;
    OdometryRun run(drive, config);
    run.run(0, 20);
    EXPECT_FALSE(run.frames[0].valid);
    EXPECT_LE(run.first_valid(), 3U);
    expect_good_from(run, run.first_valid());
}

// Once it is in doubt where the robot is, that nothing speaks against a pose does not make it valid again.
TEST(WithoutImu, NoPoseIsValidAfterASuddenTurnUntilTheMapBeginsAnew) {
    constexpr std::size_t kTurn = 15;
    SimulatedDrive drive(furnished_room(), [](double t) {
        Eigen::Isometry3d T = drive_on(t);
        const double turning_s = std::clamp(t - 0.1 * kTurn, 0.0, 0.6);
        T.linear() = T.linear() * Eigen::AngleAxisd(5.0 * turning_s, Eigen::Vector3d::UnitZ());
        return T;
    });
    OdometryConfig config;
    config.use_imu = false;
    OdometryRun run(drive, config);
    run.run(0, 45);
    bool anew = false;
    for (std::size_t i = kTurn; i < run.frames.size(); ++i) {
        anew = anew || (run.frames[i].flags & kReinitialized) != 0;
        EXPECT_TRUE(anew || !run.frames[i].valid || run.position_error(i) < 0.1) << i;
    }
    EXPECT_TRUE(run.frames[kTurn - 1].valid);
    EXPECT_TRUE(run.frames.back().valid);
}

class Gap : public testing::TestWithParam<bool> {};

TEST_P(Gap, OfThreeSecondsEndsInTheSameMap) {
    constexpr int kFrom = 15;
    constexpr int kTo = 45;
    SimulatedDrive drive(furnished_room(), [](double time_s) {
        const double t = after_rest(time_s);
        Eigen::Isometry3d T = drive_on(0.5 * t);
        T.linear() = T.linear() * Eigen::AngleAxisd(0.04 * std::sin(9.0 * t), Eigen::Vector3d::UnitX());
        return T;
    });
    OdometryConfig config;
    config.use_imu = GetParam();
    OdometryRun run(drive, config);
    run.run(0, kFrom);
    run.run(kTo, kTo + 15);
    EXPECT_FALSE(run.any(kReinitialized));
    EXPECT_TRUE(run.frames[kFrom].valid);
    for (std::size_t i = 1; i < run.frames.size(); ++i) EXPECT_LT(run.position_error(i), 0.05) << i;
}

INSTANTIATE_TEST_SUITE_P(Odometry, Gap, testing::Bool());

// Over the gap nobody has looked: the map is not given up with the first scan after it that fits nowhere.
TEST(WithoutImu, ScansAfterAGapThatFitNowhereDoNotEndTheMapAtOnce) {
    constexpr int kFrom = 15;
    constexpr int kTo = 40;
    constexpr int kTurned = 3;
    SimulatedDrive drive(furnished_room(), [](double t) {
        Eigen::Isometry3d T = drive_on(0.02 * t);
        if (t > 0.1 * kTo - 0.05 && t < 0.1 * (kTo + kTurned) - 0.05)
            T.linear() = T.linear() * Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitZ());
        return T;
    });
    OdometryConfig config;
    config.use_imu = false;
    OdometryRun run(drive, config);
    run.run(0, kFrom);
    run.run(kTo, kTo + 30);
    EXPECT_FALSE(run.any(kReinitialized));
    EXPECT_FALSE(run.frames[kFrom].valid);
    EXPECT_TRUE(run.frames.back().valid);
    EXPECT_LT(run.largest_position_error(), 0.05);
}

struct ClockStep {
    const char* name;
    double lidar_s;
    bool imu_too;
};

class SteppedClock : public testing::TestWithParam<ClockStep> {};

TEST_P(SteppedClock, RestartsWhereItWas) {
    constexpr int kStep = 20;
    const auto offset_ns = static_cast<std::int64_t>(GetParam().lidar_s * 1e9);
    SimulatedDrive drive(furnished_room(), drive_on);
    drive.spoil_frame = [&](int k, Frame& frame) {
        if (k < kStep) return;
        move_clock(frame, offset_ns);
        if (!GetParam().imu_too) return;
        for (ImuSample& s : frame.imu) s.stamp_ns += offset_ns;
    };
    OdometryRun run(drive, {});
    run.run(0, 45);
    EXPECT_TRUE(run.frames[kStep].flags & kReinitialized);
    EXPECT_FALSE(run.frames[kStep].valid);
    expect_good_from(run, kStep + 2);
    EXPECT_LT(run.relative_error(kStep - 1, run.frames.size() - 1).translation().norm(), 0.5);
}

INSTANTIATE_TEST_SUITE_P(Odometry, SteppedClock,
                         testing::Values(ClockStep{"LidarAloneBack", -3.0, false},
                                         ClockStep{"LidarAloneFarBack", -900.0, false},
                                         ClockStep{"BothBack", -3.0, true}, ClockStep{"LidarAloneForward", 30.0, false},
                                         ClockStep{"BothForward", 30.0, true}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace dlod::test
