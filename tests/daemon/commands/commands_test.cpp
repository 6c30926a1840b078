// The program's command line: good runs, and bad input that must end in a clear error.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/child_process.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/synthetic_capture.hpp"
#include "tests/support/test_data.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;

struct Outcome {
    int exit_code = -1;
    std::string output;
};

Outcome dlod(std::vector<std::string> arguments, test::ChildProcess::Options options = {}) {
    arguments.insert(arguments.begin(), DLOD_BINARY);
    test::ChildProcess child(std::move(arguments), options);
    const auto exit_code = child.wait(60s);
    return {exit_code.value_or(-1), child.output()};
}

testing::AssertionResult ends(const Outcome& outcome, int exit_code, std::initializer_list<const char*> words) {
    if (outcome.exit_code != exit_code) {
        return testing::AssertionFailure() << "exit code " << outcome.exit_code << " instead of " << exit_code << "\n"
                                           << outcome.output;
    }
    for (const char* word : words) {
        if (outcome.output.find(word) == std::string::npos) {
            return testing::AssertionFailure() << "'" << word << "' is not in the output:\n" << outcome.output;
        }
    }
    return testing::AssertionSuccess();
}

class CommandsTest : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        folder_ = new test::TemporaryFolder;
        capture_ = test::SyntheticCapture(12).write(folder_->path()).string();
    }
    static void TearDownTestSuite() { delete folder_; }
    static std::string file(const std::string& name) { return (folder_->path() / name).string(); }
    static std::string write(const std::string& name, const std::string& content) {
        std::ofstream(file(name), std::ios::binary) << content;
        return file(name);
    }

    static test::TemporaryFolder* folder_;
    static std::string capture_;
};
test::TemporaryFolder* CommandsTest::folder_ = nullptr;
std::string CommandsTest::capture_;

TEST_F(CommandsTest, ReplayWritesTheFolderAndASummary) {
    EXPECT_TRUE(
        ends(dlod({"replay", capture_, "--out", file("new/folder"), "--threads", "1"}), 0, {"12 frames", "odometry"}));
    for (const char* name : {"trajectory.tum", "frames.csv", "labels.bin", "instances.bin", "tracks.csv", "map.pcd"}) {
        EXPECT_TRUE(std::filesystem::exists(folder_->path() / "new/folder" / name)) << name;
    }
}

TEST_F(CommandsTest, HelpAndVersion) {
    EXPECT_TRUE(ends(dlod({"rum"}), 2, {"'rum'", "--help"}));
    EXPECT_TRUE(ends(dlod({"--version"}), 0, {"dlod "}));
    EXPECT_TRUE(
        ends(dlod({"--help"}), 0, {"replay", "run", "info", "doctor", "check-config", "print-config", "Exit codes"}));
    for (const char* command : {"run", "replay", "info", "doctor", "check-config", "print-config"}) {
        EXPECT_TRUE(ends(dlod({command, "--help"}), 0, {"Exit codes"})) << command;
    }
    EXPECT_TRUE(ends(dlod({}), 2, {}));
    EXPECT_TRUE(ends(dlod({"replay"}), 2, {"PCAP"}));
    EXPECT_TRUE(ends(dlod({"fly"}), 2, {}));
    EXPECT_TRUE(ends(dlod({"command", "fly"}), 2, {"save-map"}));
    EXPECT_TRUE(ends(dlod({"run"}), 3, {"sensor.host", "sensor.metadata"}));
}

TEST_F(CommandsTest, DoctorNamesRemedies) {
    const auto outcome = dlod({"doctor", "--set", "sensor.receive_buffer_bytes=1000000000", "--set", "lcm.url=none"});
    EXPECT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 1) << outcome.exit_code;
    EXPECT_TRUE(ends(outcome, outcome.exit_code, {"receive buffer", "net.core.rmem_max=1000000000", "clock"}));
    for (const char* folder : {"recording.folder", "saved_maps.folder", "output.folder"}) {
        const auto unusable = dlod({"doctor", "--set", "lcm.url=none", "--set", std::string(folder) + "=" + capture_});
        EXPECT_TRUE(ends(unusable, 1, {"is no folder"})) << folder;
    }
}

TEST_F(CommandsTest, Info) {
    EXPECT_TRUE(
        ends(dlod({"info", capture_}), 0, {"OS-0-32", "123456", "RNG15_RFL8_NIR8", "32 x 512", "frames", "12"}));
    EXPECT_TRUE(ends(dlod({"info", file("drive.json")}), 0, {"OS-0-32", "7502"}));
    auto reduced = nlohmann::json::parse(test::SyntheticCapture::metadata());
    for (const char* key : {"prod_line", "prod_sn", "build_rev"}) reduced.erase(key);
    EXPECT_TRUE(ends(dlod({"info", write("reduced.json", reduced.dump())}), 0,
                     {"sensor    unknown, serial unknown, firmware unknown\n"}));
}

TEST_F(CommandsTest, ConfigurationErrorsNameTheKey) {
    const auto bad = write("bad.yaml", "pipeline:\n  thread: 1\n");
    EXPECT_TRUE(ends(dlod({"check-config", bad}), 3, {"bad.yaml:2", "pipeline.threads"}));
    EXPECT_TRUE(ends(dlod({"replay", capture_, "-c", bad}), 3, {"bad.yaml:2", "pipeline.threads"}));
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--set", "odometry.use_imu=perhaps"}), 3, {"odometry.use_imu"}));
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--threads", "0"}), 3, {"pipeline.threads"}));
    EXPECT_TRUE(ends(dlod({"check-config", write("good.yaml", "odometry: {use_imu: off}\n")}), 0, {"valid"}));
    EXPECT_TRUE(ends(dlod({"check-config", write("group.yaml", "sensor: {multicast_group: eth0}\n")}), 3,
                     {"group.yaml", "sensor.multicast_group"}));
    EXPECT_TRUE(ends(dlod({"run"}), 3, {"sensor.metadata"}));
}

TEST_F(CommandsTest, CapturesThatCannotBeUsed) {
    const auto metadata = file("drive.json");
    EXPECT_TRUE(ends(dlod({"replay", file("absent.pcap"), "--metadata", metadata}), 4, {"absent.pcap"}));
    EXPECT_TRUE(ends(
        dlod({"replay", write("text.pcap", "this is no capture, but long enough to be one"), "--metadata", metadata}),
        4, {"text.pcap"}));
    EXPECT_TRUE(ends(dlod({"replay", write("nothing.pcap", ""), "--metadata", metadata}), 4, {"nothing.pcap"}));
    // What is wrong with the capture is said before what is wrong with its metadata.
    EXPECT_TRUE(ends(dlod({"replay", file("absent.pcap")}), 4, {"absent.pcap"}));
    EXPECT_TRUE(ends(dlod({"info", file("absent.pcap")}), 4, {"absent.pcap"}));
    std::filesystem::copy(capture_, file("alone.pcap"));
    EXPECT_TRUE(ends(dlod({"replay", file("alone.pcap")}), 3, {"alone.json", "--metadata"}));
    EXPECT_TRUE(ends(dlod({"info", file("alone.pcap")}), 3, {"alone.json", "--metadata"}));
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--metadata", write("broken.json", "{\"beam_altitude_angles\": [1, 2")}),
                     3, {"broken.json"}));
}

TEST_F(CommandsTest, ATruncatedCaptureIsReplayedToItsEnd) {
    std::ifstream stream(capture_, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    bytes.resize(bytes.size() * 2 / 3 + 7);
    const auto cut = write("cut.pcap", bytes);
    EXPECT_TRUE(ends(dlod({"replay", cut, "--metadata", file("drive.json"), "--out", file("cut")}), 0, {"frames"}));
}

TEST_F(CommandsTest, AnEmptyCaptureIsSaidOnce) {
    std::ifstream stream(capture_, std::ios::binary);
    std::string header(24, '\0');
    stream.read(header.data(), 24);
    const auto outcome = dlod({"replay", write("empty.pcap", header), "--metadata", file("drive.json")});
    EXPECT_TRUE(ends(outcome, 0, {"the capture has no packets", "0 frames"}));
    EXPECT_EQ(outcome.output.find("metadata"), std::string::npos) << outcome.output;
}

TEST_F(CommandsTest, AnImuProfileThatIsNotKnownIsAWarningAndOdometryGoesOnWithoutImu) {
    auto metadata = test::SyntheticCapture::metadata();
    const std::string legacy = "\"udp_profile_imu\": \"LEGACY\"";
    ASSERT_NE(metadata.find(legacy), std::string::npos);
    metadata.replace(metadata.find(legacy), legacy.size(), "\"udp_profile_imu\": \"ACCEL32_GYRO32_NMEA\"");
    EXPECT_TRUE(
        ends(dlod({"replay", capture_, "--metadata", write("other_imu.json", metadata)}), 0,
             {"ACCEL32_GYRO32_NMEA", "the IMU is not used", "12 frames, 11 valid poses", "imu_unknown_packets"}));
}

TEST_F(CommandsTest, TheRobotsOwnBodyIsNotSeen) {
    // The hall's near wall becomes a part of the robot: fewer returns in every frame, and no error.
    const auto points = [&](const std::string& name, const std::string& boxes) {
        EXPECT_TRUE(ends(dlod({"replay", capture_, "--out", file(name), "--set", "robot_body.boxes_m=" + boxes}), 0,
                         {"12 valid poses"}));
        std::ifstream stream(file(name) + "/frames.csv");
        std::string line;
        std::getline(stream, line);
        std::getline(stream, line);
        for (int column = 0; column < 4; ++column) line.erase(0, line.find(',') + 1);
        return std::stoi(line);
    };
    const int all = points("all", "[]");
    const int without = points("without", "[-3, -30, -30, 3, 30, 30]");
    EXPECT_LT(without, all - 1000);
    EXPECT_GT(without, 1000);
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--set", "robot_body.boxes_m=[0, 0, 0, 1, 1]"}), 3,
                     {"robot_body.boxes_m", "six"}));
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--set", "robot_body.boxes_m=[0, 0, 0, 1, -1, 1]"}), 3,
                     {"robot_body.boxes_m", "box 1"}));
}

TEST_F(CommandsTest, AnotherMakersCaptureGivesNoFrames) {
    const auto capture = test::data_path("ouster/VLI-16-one-packet.pcap");
    if (!capture) GTEST_SKIP() << "the recorded captures are not there";
    EXPECT_TRUE(ends(dlod({"replay", capture->string(), "--metadata", file("drive.json"), "--out", file("other")}), 0,
                     {"0 frames"}));
}

TEST_F(CommandsTest, OutputThatCannotBeWritten) {
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--out", "/proc/nowhere"}), 5, {"/proc/nowhere"}));
    write("a_file", "x");
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--out", file("a_file")}), 5, {"a_file"}));
    // As on a full disk: the 100 kB are reached in the middle of labels.bin.
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--out", file("full")}, {.environment = {}, .largest_file = 100'000}), 5,
                     {"cannot write"}));
}

TEST_F(CommandsTest, AReplayOntoAFullDiskSaysSo) {
    const test::SmallDisk disk(300'000);
    if (!disk.usable()) GTEST_SKIP() << "no file system can be mounted here";
    EXPECT_TRUE(ends(dlod({"replay", capture_, "--out", (disk.path() / "run").string()}), 5,
                     {"cannot write", "No space left", "run/"}));
}

TEST_F(CommandsTest, ASignalEndsAReplayWithAllOutputsComplete) {
    for (const int signal : {SIGINT, SIGHUP}) {  // the terminal's keys, and its end
        const auto out = folder_->path() / ("interrupted_" + std::to_string(signal));
        test::ChildProcess child({DLOD_BINARY, "replay", capture_, "--out", out.string(), "--rate", "0.2"});
        for (int i = 0; i < 500; ++i) {
            std::error_code error;
            if (std::filesystem::file_size(out / "labels.bin", error) > 0 && !error) break;
            ::usleep(10'000);
        }
        child.signal(signal);
        EXPECT_EQ(child.wait(test::kTooSlowForTimes ? 30s : 5s), 7) << child.output();
        EXPECT_TRUE(std::filesystem::exists(out / "map.pcd"));
    }
}

TEST_F(CommandsTest, LcmWithoutAMulticastRouteIsAnErrorAtOnce) {
    if (test::ChildProcess({"unshare", "-r", "-n", "true"}).wait(5s) != 0) GTEST_SKIP() << "no network namespaces here";
    test::ChildProcess child(
        {"unshare", "-r", "-n", DLOD_BINARY, "replay", capture_, "--lcm", "udpm://239.255.76.98:17668?ttl=0"});
    EXPECT_EQ(child.wait(5s), 6) << child.output();
    EXPECT_NE(child.output().find("224.0.0.0/4"), std::string::npos) << child.output();
    // So it is for who starts a live run by hand, and for who sends a command: in one line, and not in LCM's words.
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"run", "--metadata", file("drive.json")}, {"command", "restart-odometry"}}) {
        std::vector<std::string> line = {"unshare", "-r", "-n", DLOD_BINARY};
        line.insert(line.end(), command.begin(), command.end());
        test::ChildProcess other(line);
        EXPECT_EQ(other.wait(5s), 6) << other.output();
        EXPECT_NE(other.output().find("224.0.0.0/4"), std::string::npos) << other.output();
        EXPECT_EQ(other.output().find("requires a valid multicast route"), std::string::npos) << other.output();
    }
}

TEST_F(CommandsTest, CommandsNeedLcm) {
    EXPECT_TRUE(ends(dlod({"command", "restart-odometry", "--lcm", "none"}), 3, {"lcm.url"}));
    EXPECT_TRUE(ends(dlod({"command", "restart-odometry", "--lcm", "239.255.76.67:7667"}), 3, {"lcm.url", "udpm://"}));
}

TEST_F(CommandsTest, WhatCannotBePrintedIsAnError) {
    test::ChildProcess child({"sh", "-c", DLOD_BINARY " print-config > /dev/full"});
    EXPECT_EQ(child.wait(5s), 5) << child.output();
    EXPECT_NE(child.output().find("standard output"), std::string::npos) << child.output();
}

}  // namespace
}  // namespace dlod
