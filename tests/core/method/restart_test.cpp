// The whole method from frame to frame: what a restart forgets, and what it does not.
#include <gtest/gtest.h>

#include <cstring>

#include "core/dynamic_lidar_odometry.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod {
namespace {

constexpr int kRestart = 14;
constexpr int kFrames = 28;

Eigen::Isometry3d drive(double t) {
    return make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, 0.2 * t)), Eigen::Vector3d(1.0 * t - 4.0, 0.3 * t, 1.2));
}

/// The furnished room, and somebody who walks across it.
std::vector<test::SceneBox> busy_room() {
    auto scene = test::furnished_room();
    scene.push_back({.low = {1.0, -4.0, 0.0}, .high = {1.5, -3.5, 1.7}, .velocity = {0.0, 1.4, 0.0}});
    return scene;
}

/// Everything of a frame's results that leaves the method.
struct Results {
    Eigen::Isometry3d pose;
    std::uint32_t flags;
    bool valid;
    Image<std::uint8_t> label;
    std::vector<std::uint32_t> ids;

    explicit Results(const Frame& frame)
        : pose(frame.odometry.T_world_sensor),
          flags(frame.odometry.flags),
          valid(frame.odometry.valid),
          label(frame.detection.label) {
        for (const Track& track : frame.detection.tracks) ids.push_back(track.id);
    }
};

TEST(Restart, ARestartIsAFirstStartButForTheTracksIds) {
    test::SimulatedDrive room(busy_room(), drive);
    DynamicLidarOdometry restarted(room.sensor(), {});
    DynamicLidarOdometry fresh(room.sensor(), {});
    Frame frame(room.sensor());
    Frame copy(room.sensor());
    std::uint32_t highest_id_before = 0;
    bool dynamic_before = false;
    int tracks_after = 0;
    for (int k = 0; k < kFrames; ++k) {
        room.fill(k, frame);
        frame.restart = k == kRestart;
        copy = frame;
        copy.restart = false;
        restarted.process(frame);
        const Results a(frame);
        EXPECT_EQ((a.flags & OdometryResult::kStarted) != 0, k == 0 || k == kRestart) << "frame " << k;
        if (k < kRestart) {
            for (const auto id : a.ids) highest_id_before = std::max(highest_id_before, id);
            dynamic_before = dynamic_before || frame.detection.dynamic_points > 0;
            continue;
        }
        fresh.process(copy);
        const Results b(copy);
        ASSERT_EQ(a.valid, b.valid) << "frame " << k;
        EXPECT_EQ(a.flags, b.flags) << "frame " << k;
        EXPECT_TRUE(a.pose.matrix() == b.pose.matrix()) << "frame " << k;
        EXPECT_EQ(std::memcmp(a.label.data(), b.label.data(), a.label.size()), 0) << "frame " << k;
        ASSERT_EQ(a.ids.size(), b.ids.size());
        for (std::size_t i = 0; i < a.ids.size(); ++i) {
            EXPECT_GT(a.ids[i], highest_id_before) << "an id is never used twice";
            EXPECT_EQ(a.ids[i] - b.ids[i], a.ids[0] - b.ids[0]) << "in the same order as after a first start";
            ++tracks_after;
        }
    }
    EXPECT_TRUE(dynamic_before) << "else this would show little";
    EXPECT_GT(highest_id_before, 0U);
    EXPECT_GT(tracks_after, 0);
    restarted.map().finish();
    fresh.map().finish();
    const auto map = restarted.map().points();
    const auto fresh_map = fresh.map().points();
    ASSERT_EQ(map.size(), fresh_map.size());
    EXPECT_GT(map.size(), 1000U);
    EXPECT_EQ(std::memcmp(map.data(), fresh_map.data(), map.size() * sizeof(MapPoint)), 0);
}

}  // namespace
}  // namespace dlod
