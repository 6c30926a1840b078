// Faults injected into the running program: it goes on, and says what is wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/daemon/live/live_run.hpp"
#include "tests/support/fake_sensor.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/tcpq_server.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;
using test::FakeSensor;
using test::LiveRun;
using test::on_live_ports;

class Faults : public testing::Test {
  protected:
    void SetUp() override {
        if (!run.usable()) GTEST_SKIP() << "no multicast here";
        sensor = std::make_unique<FakeSensor>(on_live_ports());
        run.write_config("host: \"" + sensor->host() + "\"");
    }
    auto counted(const char* name) const {
        return [name](const status_t& status) { return test::counter(status, name) > 0; };
    }

    LiveRun run;
    std::unique_ptr<FakeSensor> sensor;
};

TEST_F(Faults, KilledAndStartedAgainWhileTheSensorsWebServerIsAway) {
    run.start();
    EXPECT_TRUE(run.poses_flow());
    run.daemon->signal(SIGKILL);
    EXPECT_EQ(run.daemon->wait(5s), 128 + SIGKILL);
    sensor->answers = false;
    run.systemd.clear();
    run.start();
    EXPECT_TRUE(run.log_says("going on with the metadata that it gave last time"));
    EXPECT_TRUE(run.poses_flow()) << "the state directory had what is needed";
    run.stop();
}

TEST_F(Faults, StoppedForThreeSeconds) {
    run.start();
    EXPECT_TRUE(run.poses_flow());
    run.daemon->signal(SIGPIPE);  // a sensor that hangs up, or who read the log: no reason to end
    run.daemon->signal(SIGSTOP);
    std::this_thread::sleep_for(3s);
    run.daemon->signal(SIGCONT);
    const auto resumed = std::chrono::system_clock::now().time_since_epoch();
    EXPECT_TRUE(run.poses_flow(5, 5s));
    const std::int64_t resumed_us = std::chrono::duration_cast<std::chrono::microseconds>(resumed).count();
    int old_poses = 0;
    for (const auto& pose : run.subscriber.poses()) old_poses += pose.utime < resumed_us - 500'000 ? 1 : 0;
    EXPECT_LE(old_poses, 2) << "of frames that were at work; what waited for seconds is left out";
    EXPECT_TRUE(run.status_says(counted("pipeline_dropped_frames")));
    run.stop();
}

TEST_F(Faults, TheProcessorIsTakenAway) {
    if (test::kTooSlowForTimes) GTEST_SKIP() << "a sanitizer leaves too little of a twentieth";
    run.start();
    EXPECT_TRUE(run.poses_flow());
    run.subscriber.clear();
    for (int i = 0; i < 16; ++i) {  // a twentieth of the time is left to it
        run.daemon->signal(SIGSTOP);
        std::this_thread::sleep_for(285ms);
        run.daemon->signal(SIGCONT);
        std::this_thread::sleep_for(15ms);
    }
    const auto poses = run.subscriber.poses();
    EXPECT_GE(poses.size(), 5U) << "the newest frames are still worked on";
    for (const auto& pose : poses) {
        EXPECT_NE(pose.flags & pose_t::VALID, 0);
        EXPECT_LT(std::hypot(pose.position[0], pose.position[1], pose.position[2]), 0.1) << "the sensor stands still";
    }
    EXPECT_TRUE(run.status_says(counted("pipeline_dropped_frames")));
    EXPECT_TRUE(run.poses_flow(20, 4s)) << "every frame again";
    run.stop();
}

#ifdef DLOD_STEPPED_CLOCK
TEST_F(Faults, TheClockIsSetByAnHour) {
    const auto clock = run.folder.path() / "clock";
    const auto set_clock = [&](std::int64_t offset_ns) {
        // In place: the program has mapped the file.
        std::fstream file(clock, std::ios::binary | std::ios::in | std::ios::out);
        file.write(reinterpret_cast<const char*>(&offset_ns), sizeof offset_ns);
    };
    std::ofstream(clock, std::ios::binary) << std::string(sizeof(std::int64_t), '\0');
    run.start({}, {}, {"LD_PRELOAD=" DLOD_STEPPED_CLOCK, "DLOD_TEST_CLOCK=" + clock.string()});
    EXPECT_TRUE(run.poses_flow());
    const auto latest_us = [&] { return run.subscriber.poses().back().utime; };
    constexpr std::int64_t kHour_us = 3'600'000'000;
    const std::int64_t before_us = latest_us();
    const auto dropped = [](const status_t& status) { return test::counter(status, "pipeline_dropped_frames"); };
    std::int64_t dropped_before = -1;  // a busy machine drops some while the program starts
    EXPECT_TRUE(run.status_says([&](const status_t& status) { return (dropped_before = dropped(status)) >= 0; }));
    set_clock(1000 * kHour_us);
    EXPECT_TRUE(run.log_says("moved by 3600", 10s));
    EXPECT_TRUE(run.poses_flow());
    EXPECT_NEAR(1e-6 * static_cast<double>(latest_us() - before_us), 3600.0, 10.0) << "utime follows a step forward";

    const std::int64_t forward_us = latest_us();
    set_clock(0);
    EXPECT_TRUE(run.log_says("moved by -3600", 10s));
    EXPECT_TRUE(run.poses_flow());
    EXPECT_GT(latest_us(), forward_us) << "utime never goes back";
    // What was dropped is remembered for ten seconds; a busy machine may cost a frame even now.
    EXPECT_TRUE(run.status_says(
        [&](const status_t& status) {
            return status.health == status_t::OK && status.stage_max.back() < 1000.0F &&
                   dropped(status) <= dropped_before + 2;
        },
        25s))
        << "neither latencies nor health are taken in";
    run.stop();
}
#endif

TEST_F(Faults, DiskFullWhileRecordingAndWriting) {
    run.write_config("host: \"" + sensor->host() + "\"",
                     "recording: {folder: " + (run.folder.path() / "recording").string() + "}\n");
    run.start({"--out", (run.folder.path() / "out").string()}, 300'000);
    EXPECT_TRUE(run.status_says(counted("recording_write_failed")));
    EXPECT_TRUE(run.status_says(counted("output_failures")));
    EXPECT_TRUE(run.log_says("no more result files are written"));
    EXPECT_TRUE(run.log_says("tried again every few seconds"));
    EXPECT_TRUE(run.poses_flow()) << "poses go on";
    run.stop();
}

TEST_F(Faults, TheDiskIsFullAndHasRoomAgain) {
    const test::SmallDisk disk(12 << 20);
    if (!disk.usable()) GTEST_SKIP() << "no file system can be mounted here";
    run.write_config("host: \"" + sensor->host() + "\"",
                     "recording: {folder: " + (disk.path() / "recording").string() + "}\n");
    run.start({"--out", (disk.path() / "out").string()});
    EXPECT_TRUE(run.poses_flow());
    disk.fill();
    EXPECT_TRUE(run.log_says("No space left on device; no more result files are written", 15s));
    EXPECT_TRUE(run.status_says([](const status_t& s) {
        return s.health == status_t::DEGRADED && s.health_text.find("recording.folder") != std::string::npos &&
               s.health_text.find("output.folder") != std::string::npos;
    })) << "a planner and lcm-spy are told";
    EXPECT_TRUE(run.poses_flow()) << "poses go on";
    disk.clear();
    EXPECT_TRUE(run.log_says("recording: goes on in", 20s));
    run.stop();
    for (const auto& entry : std::filesystem::directory_iterator(disk.path() / "recording")) {
        if (entry.path().extension() != ".pcap") continue;
        test::ChildProcess info({DLOD_BINARY, "info", entry.path().string()});
        EXPECT_EQ(info.wait(20s), 0) << info.output();
        EXPECT_EQ(info.output().find("warning"), std::string::npos) << info.output();
    }
}

TEST_F(Faults, ResultFilesThatCannotBeMadeDoNotKeepAServiceFromItsWork) {
    std::ofstream(run.folder.path() / "blocked") << "x";
    run.start({"--out", (run.folder.path() / "blocked").string()});
    EXPECT_TRUE(run.log_says("no result files are written"));
    EXPECT_TRUE(run.poses_flow());
    EXPECT_TRUE(
        run.status_says([](const status_t& s) { return s.health_text.find("output.folder") != std::string::npos; }));
    run.stop();
}

/// systemd would end a stop that takes longer than the unit allows, and the map would be lost.
TEST_F(Faults, AMapThatIsSavedAtTheStopHasTheTimeForIt) {
    run.start({"--set", "saved_maps.at_stop=true"});
    EXPECT_TRUE(run.poses_flow());
    run.stop();
    EXPECT_TRUE(run.systemd.wait_for("EXTEND_TIMEOUT_USEC=60000000", 1s)) << run.systemd.messages();
    EXPECT_TRUE(std::filesystem::exists(run.folder.path() / "maps" / "last.pcd")) << run.daemon->output();
}

TEST_F(Faults, APortThatAnotherProgramHasIsAwaited) {
    auto other = std::make_unique<test::ChildProcess>(
        std::vector<std::string>{DLOD_BINARY, "run", "-c", run.config().string(), "--lcm", "none"});
    for (int i = 0; i < 500 && other->output().find("receiving on port") == std::string::npos; ++i)
        std::this_thread::sleep_for(20ms);
    run.start();
    EXPECT_TRUE(run.systemd.wait_for("is in use by another program", 10s)) << run.daemon->output();
    other.reset();
    EXPECT_TRUE(run.poses_flow()) << "no restart was needed";
    run.stop();
}

TEST_F(Faults, NetworkOfTheMessagesGoneAndBack) {
    if (!run.has_own_network()) GTEST_SKIP() << "the host's routes are not touched";
    run.start();
    EXPECT_TRUE(run.poses_flow());
    ASSERT_EQ(std::system("ip route del 224.0.0.0/4 dev lo"), 0);
    std::this_thread::sleep_for(1s);
    ASSERT_EQ(std::system("ip route add 224.0.0.0/4 dev lo"), 0);
    EXPECT_TRUE(run.poses_flow());
    EXPECT_TRUE(run.status_says(counted("lcm_failed")));
    run.stop();
}

TEST_F(Faults, ANetworkOfTheMessagesThatComesLateIsAwaited) {
    if (!run.has_own_network()) GTEST_SKIP() << "the host's routes are not touched";
    ASSERT_EQ(std::system("ip route del 224.0.0.0/4 dev lo"), 0);
    run.start();
    EXPECT_TRUE(run.systemd.wait_for("LCM cannot be opened", 5s)) << "systemctl status says what it waits for";
    ASSERT_EQ(std::system("ip route add 224.0.0.0/4 dev lo"), 0);
    EXPECT_TRUE(run.poses_flow());
    run.stop();
}

TEST_F(Faults, AServerOfTcpqThatStallsHoldsUpNoFrame) {
    test::TcpqServer server(test::TcpqServer::Manners::kNeverAnswers);
    run.start({"--lcm", server.url()});
    EXPECT_TRUE(run.systemd.wait_for("lcm_failed: ", 30s)) << "it is told what is lost";
    const auto frames_go_on = [&] {
        const std::string told = run.systemd.messages();
        const auto last = told.rfind("STATUS=");
        return told.find("poses/s, pose", last) != std::string::npos &&
               (test::kTooSlowForTimes || told.find("pipeline_dropped_frames", last) == std::string::npos);
    };
    EXPECT_TRUE(LiveRun::eventually(30s, frames_go_on)) << run.systemd.messages();
    test::ChildProcess command({DLOD_BINARY, "command", "restart-odometry", "--timeout", "0.5", "--lcm", server.url()});
    EXPECT_EQ(command.wait(20s), 6) << command.output();
    EXPECT_NE(command.output().find("its server does not answer"), std::string::npos) << command.output();
    run.stop();
}

}  // namespace
}  // namespace dlod
