// Times as far off as a driver lets through: they may cost a few frames, but nothing hangs, overflows or stays wrong.
#include <gtest/gtest.h>

#include <map>

#include "core/dynamic_lidar_odometry.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod {
namespace {

constexpr std::int64_t kLatest_ns = (std::int64_t{1} << 62U) - 1;
constexpr int kFrames = 40;

Eigen::Isometry3d drive(double t) {
    const double way = test::after_rest(t);
    return make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, 0.2 * way)), Eigen::Vector3d(way - 2.0, 0.3 * way, 0.0));
}

void shift(Frame& frame, std::int64_t by_ns) {
    frame.header.stamp_ns += by_ns;
    frame.header.first_stamp_ns += by_ns;
    for (std::int64_t& time : frame.columns.time_ns) time += by_ns;
    for (ImuSample& sample : frame.imu) sample.stamp_ns += by_ns;
}

class AbsurdTimes : public testing::TestWithParam<bool> {};

TEST_P(AbsurdTimes, AreSurvived) {
    test::DriveOptions options;
    options.imu = GetParam();
    test::SimulatedDrive room(test::furnished_room(), drive, options);
    // Single frames, and a stretch that stays there.
    const std::map<int, std::int64_t> stamps = {
        {10, kLatest_ns}, {12, 100'000'000}, {13, kLatest_ns}, {15, kLatest_ns - 1'000'000'000'000}};
    DynamicLidarOdometry method(room.sensor(), {});
    Frame frame(room.sensor());
    Eigen::Isometry3d later;
    double later_s = 0.0;
    for (int k = 0; k < kFrames; ++k) {
        room.fill(k, frame);
        const auto stamp = stamps.find(k);
        if (stamp != stamps.end()) shift(frame, stamp->second - frame.header.stamp_ns);
        if (k > 16 && k <= 22) shift(frame, kLatest_ns - 10'000'000'000'000);
        method.process(frame);
        if (k == 30) {
            later = frame.odometry.T_world_sensor;
            later_s = room.last_stamp_s();
        }
        ASSERT_TRUE(frame.odometry.T_world_sensor.matrix().allFinite()) << k;
        for (const Track& track : frame.detection.tracks) {
            ASSERT_TRUE(track.box.center_m.allFinite() && track.velocity_mps.allFinite()) << k;
        }
    }
    EXPECT_TRUE(frame.odometry.valid) << "it goes on";
    const Eigen::Isometry3d moved = later.inverse() * frame.odometry.T_world_sensor;
    const Eigen::Isometry3d truth = drive(later_s).inverse() * drive(room.last_stamp_s());
    EXPECT_LT((moved.translation() - truth.translation()).norm(), 0.03) << "as if nothing had been";
}

INSTANTIATE_TEST_SUITE_P(DynamicLidarOdometry, AbsurdTimes, testing::Bool(),
                         [](const auto& test) { return test.param ? "WithImu" : "WithoutImu"; });

}  // namespace
}  // namespace dlod
