#include "daemon/commands/reload.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

class ReloadTest : public testing::Test {
  protected:
    ReloadTest() { sources_.file = folder_.path() / "dlod.yaml"; }
    Reload reload_from(const std::string& yaml) {
        std::ofstream(*sources_.file) << yaml;
        return reload(sources_, nullptr, running_);
    }

    test::TemporaryFolder folder_;
    ConfigSources sources_;
    Config running_;
};

TEST_F(ReloadTest, WhatCanChangeChangesAndTheRestIsNamed) {
    running_.sensor.host = "os-1";
    const Reload result = reload_from(
        "log: {level: debug}\nsensor: {sender: 10.0.0.2, host: os-1, configure: {lidar_mode: 1024x10}}\n"
        "recording: {folder: r, files: 3}\npipeline: {threads: 3}\ntracking: {association: {alpha: 0.25}}\n");
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(result.changed,
              (std::vector<std::string>{"sensor.configure.lidar_mode: \"1024x10\"", "recording.folder: \"r\"",
                                        "recording.files: 3", "log.level: debug"}));
    ASSERT_EQ(result.at_restart.size(), 3U);
    EXPECT_EQ(result.at_restart[0], "sensor.sender: \"10.0.0.2\"");
    EXPECT_EQ(result.at_restart[1], "pipeline.threads: 3");
    EXPECT_TRUE(result.at_restart[2].starts_with("tracking."));
    EXPECT_EQ(running_.log.level, 1);
    EXPECT_EQ(running_.sensor.configure.lidar_mode, "1024x10");
    EXPECT_EQ(running_.recording.files, 3);
    EXPECT_EQ(running_.sensor.sender, "") << "the running configuration tells what is in force";
    EXPECT_EQ(running_.pipeline.threads, Config().pipeline.threads);
}

TEST_F(ReloadTest, ABadFileChangesNothing) {
    for (const char* bad : {"log: {level: debug, file: x}\n", "log: {level: debug}\npipeline: {threads: 0}\n",
                            "log: {level: debug\n", "log: {level: debug}\nrecording: {files: many}\n"}) {
        const Reload result = reload_from(bad);
        EXPECT_NE(result.error.find("dlod.yaml"), std::string::npos) << bad;
        EXPECT_TRUE(result.changed.empty());
        EXPECT_TRUE(result.at_restart.empty());
        EXPECT_EQ(running_.log.level, Config().log.level);
    }
    std::filesystem::remove(*sources_.file);
    EXPECT_NE(reload(sources_, nullptr, running_).error, "");
}

TEST_F(ReloadTest, TheSameFileChangesNothing) {
    const Reload result = reload_from("lcm: {channel_prefix: DLOD_}\n");
    EXPECT_TRUE(result.error.empty() && result.changed.empty() && result.at_restart.empty());
}

TEST_F(ReloadTest, SettingsOfTheCommandLineStillWin) {
    sources_.settings = {"log.level=error"};
    running_.log.level = 4;
    EXPECT_TRUE(reload_from("log: {level: debug}\n").changed.empty());
    EXPECT_EQ(running_.log.level, 4);
}

}  // namespace
}  // namespace dlod::daemon
