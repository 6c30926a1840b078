// The whole program, live, at a sensor's full size and rate: packets by UDP from the simulator in a process of its own,
// messages over LCM's multicast, counted by a real subscriber.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/daemon/live/live_run.hpp"
#include "tests/support/file_content.hpp"
#include "tests/support/sanitizers.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;
using test::content;

/// Under a sanitizer a small sensor that turns ten times slower.
constexpr bool kSmall = test::kTooSlowForTimes;
constexpr std::size_t kFrames = kSmall ? 12 : 40;
constexpr std::size_t kPacketsPerFrame = kSmall ? 32 : 64;

#ifdef DLOD_SIM_BINARY
std::vector<std::string> simulator_of(std::size_t frames, const std::vector<std::string>& more) {
    std::vector<std::string> command = {DLOD_SIM_BINARY, "square", "--frames", std::to_string(frames)};
    if (kSmall)
        command.insert(command.end(),
                       {"--sensor", "OS0-32", "--mode", "512x10", "--profile", "RNG15_RFL8_NIR8", "--rate", "0.1"});
    command.insert(command.end(), more.begin(), more.end());
    return command;
}
#endif

/// What was recorded on the way gives the same results again.
void expect_same_by_replay(const std::filesystem::path& recording, const std::filesystem::path& live) {
    std::vector<std::string> command = {DLOD_BINARY, "replay"};
    for (const auto& entry : std::filesystem::directory_iterator(recording)) {
        if (entry.path().extension() == ".pcap") command.push_back(entry.path());
    }
    ASSERT_EQ(command.size(), 3U) << "one file";
    command.insert(command.end(), {"--out", (recording / "out").string()});
    test::ChildProcess replay(command);
    ASSERT_EQ(replay.wait(60s), 0) << replay.output();
    for (const char* name : {"trajectory.tum", "labels.bin", "instances.bin", "tracks.csv", "map.pcd"}) {
        EXPECT_TRUE(content(recording / "out" / name) == content(live / name)) << name << " differs";
    }
}

/// Between frames the poses go on by the IMU, and end where the next frame's pose is.
void expect_predicted_poses(const std::vector<pose_t>& predicted, const std::vector<pose_t>& poses) {
    // A hundred readings a second; some come before the pose that they would carry on.
    EXPECT_GT(predicted.size(), kSmall ? 0 : 5 * poses.size());
    std::int64_t last = 0;
    for (const pose_t& p : predicted) {
        EXPECT_EQ(p.flags, +pose_t::VALID + +pose_t::IMU_USED + +pose_t::PREDICTED_ONLY);
        EXPECT_GE(p.utime, last);
        last = p.utime;
        ASSERT_GE(p.sequence, 0);
        ASSERT_LT(static_cast<std::size_t>(p.sequence), poses.size());
        const pose_t& from = poses[static_cast<std::size_t>(p.sequence)];
        EXPECT_GT(p.utime, from.utime - 5'000);
        for (std::size_t next = static_cast<std::size_t>(p.sequence) + 1; next < poses.size(); ++next) {
            if (std::abs(poses[next].utime - p.utime) > 5'000) continue;
            const auto position = [](const pose_t& pose) { return Eigen::Vector3d::Map(pose.position); };
            EXPECT_LT((position(poses[next]) - position(p)).norm(), 0.03) << "at frame " << next;
        }
    }
}

TEST(Live, NoFrameIsLostFromPacketToSubscriberAndTheRecordingGivesTheSame) {
#ifndef DLOD_SIM_BINARY
    GTEST_SKIP() << "the simulator is not built";
#else
    test::LiveRun run;
    if (!run.usable()) GTEST_SKIP() << "no multicast here";
    // A drive of one frame, for the sensor's metadata.
    test::ChildProcess sensor(simulator_of(1, {"--out", run.folder.path()}));
    ASSERT_EQ(sensor.wait(30s), 0) << sensor.output();
    run.write_config("metadata: " + (run.folder.path() / "square.json").string() +
                         ", lidar_port: " + std::to_string(test::kLiveLidarPort) +
                         ", imu_port: " + std::to_string(test::kLiveImuPort) + ", sender: 127.0.0.1",
                     "recording: {folder: " + (run.folder.path() / "recording").string() + "}\n");
    run.start({"--out", (run.folder.path() / "out").string()});

    test::ChildProcess simulator(
        simulator_of(kFrames, {"--live", "127.0.0.1:" + std::to_string(test::kLiveLidarPort)}));
    ASSERT_EQ(simulator.wait(120s), 0) << simulator.output();
    const auto sent = std::chrono::system_clock::now();
    const auto dropped = [&] {
        const auto statuses = run.subscriber.statuses();
        return statuses.empty() ? 0
                                : std::max<std::int64_t>(0, test::counter(statuses.back(), "pipeline_dropped_frames"));
    };
    const auto accounted_for = [&] { return run.subscriber.pose_count() + static_cast<std::size_t>(dropped()); };
    EXPECT_TRUE(run.eventually(5s, [&] { return accounted_for() >= kFrames; }));
    EXPECT_TRUE(run.systemd.wait_for("WATCHDOG=1", 2s)) << "the watchdog is fed while frames flow";
    run.systemd.clear();
    EXPECT_TRUE(run.systemd.wait_for("STATUS=", 2s)) << "a report that has counted all frames";
    run.stop();

    EXPECT_EQ(accounted_for(), kFrames);
    if (test::kTooSlowForTimes && dropped() > 0)
        GTEST_SKIP() << "too busy a machine for a sanitizer beside: " << dropped() << " frames were late and left out";

    const auto& subscriber = run.subscriber;
    const auto poses = subscriber.poses();
    const auto masks = subscriber.masks();
    const auto tracks = subscriber.tracks();
    ASSERT_EQ(poses.size(), kFrames) << run.daemon->output();
    ASSERT_EQ(masks.size(), kFrames);
    ASSERT_EQ(tracks.size(), kFrames);
    const std::int64_t end = std::chrono::duration_cast<std::chrono::microseconds>(sent.time_since_epoch()).count();
    for (std::size_t i = 0; i < kFrames; ++i) {
        const auto sequence = static_cast<std::int64_t>(i);
        EXPECT_EQ(poses[i].sequence, sequence);
        EXPECT_EQ(masks.at(sequence), poses[i].utime);
        EXPECT_EQ(tracks.at(sequence), poses[i].utime);
        EXPECT_NE(poses[i].flags & pose_t::VALID, 0) << "frame " << i;
        // The simulated sensor's clock has nothing to do with the host's: utime is host time all the same.
        const double expected_s = 0.1 * (static_cast<double>(i + 1) - kFrames);
        EXPECT_TRUE(kSmall || std::abs(1e-6 * static_cast<double>(poses[i].utime - end) - expected_s) < 0.2)
            << "frame " << i << ": " << poses[i].utime - end;
        if (i == 0) continue;
        EXPECT_GT(poses[i].utime, poses[i - 1].utime);
    }

    expect_predicted_poses(subscriber.predicted_poses(), poses);

    const auto statuses = subscriber.statuses();
    ASSERT_GE(statuses.size(), 3U);
    const auto& status = statuses.back();
    EXPECT_NE(status.sensor.find("RNG15_RFL8_NIR8"), std::string::npos);
    EXPECT_GT(status.memory, 0);
    EXPECT_EQ(test::counter(status, "frames"), static_cast<std::int64_t>(kFrames));
    EXPECT_EQ(test::counter(status, "lidar_packets"), static_cast<std::int64_t>(kFrames * kPacketsPerFrame));
    for (const char* loss : {"lost_packets", "packets_kernel_drops", "incomplete_frames", "dropped_frames",
                             "pipeline_dropped_frames", "lcm_failed", "output_failures"}) {
        EXPECT_EQ(test::counter(status, loss), 0) << loss;
    }
    expect_same_by_replay(run.folder.path() / "recording", run.folder.path() / "out");
    ASSERT_EQ(status.stage_name.back(), "latency");
    GTEST_LOG_(INFO) << "latency from the last packet's kernel stamp to the message, ms: p50 "
                     << status.stage_p50.back() << ", p99 " << status.stage_p99.back() << ", max "
                     << status.stage_max.back();
#endif
}

}  // namespace
}  // namespace dlod
