#include "daemon/config/config_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "daemon/config/presets.hpp"
#include "driver/metadata.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

std::string error_of(const std::string& yaml) {
    Config config;
    try {
        apply_yaml(config, yaml, "robot.yaml");
    } catch (const ConfigError& error) {
        return error.what();
    }
    return "";
}

std::string error_of_setting(const std::string& setting) {
    Config config;
    try {
        apply_setting(config, setting);
    } catch (const ConfigError& error) {
        return error.what();
    }
    return "";
}

/// True where the text has all parts.
testing::AssertionResult has(const std::string& text, std::initializer_list<const char*> parts) {
    for (const char* part : parts) {
        if (text.find(part) == std::string::npos)
            return testing::AssertionFailure() << "'" << part << "' is not in: " << text;
    }
    return testing::AssertionSuccess();
}

TEST(ConfigFile, OnlyTheKeysThatItNamesChange) {
    Config config;
    const Config defaults;
    apply_yaml(config,
               "pipeline:\n  threads: 3\n  pin_to_cpus: [0, 2]\nodometry: {use_imu: off}\nhandle_dynamic_objects: no\n"
               "extrinsics:\n  translation_m: [0.1, -0.2, 1]\nlog: {level: warning}\nlcm: {channel_prefix: FRONT_}\n",
               "robot.yaml");
    EXPECT_EQ(config.pipeline.threads, 3);
    EXPECT_EQ(config.pipeline.pin_to_cpus, (std::vector<double>{0.0, 2.0}));
    EXPECT_FALSE(config.method.odometry.use_imu);
    EXPECT_FALSE(config.method.handle_dynamic_objects);
    EXPECT_EQ(config.extrinsics.translation_m, (std::array<double, 3>{0.1, -0.2, 1.0}));
    EXPECT_EQ(config.log.level, 3);
    EXPECT_EQ(config.lcm.channel_prefix, "FRONT_");
    EXPECT_EQ(config.pipeline.waiting_frames, defaults.pipeline.waiting_frames);
    EXPECT_EQ(config.lcm.url, defaults.lcm.url);
}

TEST(ConfigFile, AnEmptyFileAndEmptyGroupsChangeNothing) {
    for (const char* yaml : {"", "# nothing\n", "pipeline:\n", "{}"}) {
        Config config;
        EXPECT_NO_THROW(apply_yaml(config, yaml, "robot.yaml")) << yaml;
        EXPECT_EQ(to_yaml(config), to_yaml(Config{})) << yaml;
    }
}

TEST(ConfigFile, ErrorsNameFileLineAndKey) {
    EXPECT_TRUE(has(error_of("lcm:\n  url: none\npipeline:\n  thread: 3\n"),
                    {"robot.yaml:4", "'pipeline.thread'", "nearest", "'pipeline.threads'"}));
    EXPECT_TRUE(has(error_of("pipelin: {threads: 3}\n"), {"'pipelin'", "nearest", "'pipeline'"}));
    EXPECT_TRUE(has(error_of("pipeline:\n\tthreads: 3\n"), {"robot.yaml:", "spaces, not tabs"}));
    EXPECT_TRUE(has(error_of("threads: 3\n"), {"robot.yaml:1", "'threads'", "'pipeline.threads'"}));
    EXPECT_TRUE(has(error_of("pipeline:\n  threads: 0\n"),
                    {"robot.yaml:2", "pipeline.threads", "0 is out of range", "1 to 64"}));
    EXPECT_TRUE(has(error_of("pipeline:\n  threads: 2.5\n"), {"robot.yaml:2", "pipeline.threads", "whole number"}));
    EXPECT_TRUE(
        has(error_of("frames: {minimum_valid_share: nan}"), {"robot.yaml:1", "minimum_valid_share", "not a number"}));
    EXPECT_TRUE(has(error_of("odometry:\n\n  use_imu: maybe\n"), {"robot.yaml:3", "odometry.use_imu", "true, false"}));
    EXPECT_TRUE(has(error_of("log: {level: loud}"), {"robot.yaml:1", "log.level", "trace, debug, info"}));
    EXPECT_TRUE(has(error_of("extrinsics: {translation_m: [1, 2]}"),
                    {"robot.yaml:1", "translation_m", "2 values instead of 3"}));
    EXPECT_TRUE(has(error_of("extrinsics: {translation_m: 1}"), {"robot.yaml:1", "translation_m", "not a list"}));
    EXPECT_TRUE(has(error_of("pipeline: {threads: [1]}"), {"robot.yaml:1", "pipeline.threads", "not a list"}));
    EXPECT_TRUE(
        has(error_of("pipeline:\n  threads: 1\n  threads: 2\n"), {"robot.yaml:3", "pipeline.threads", "twice"}));
    EXPECT_TRUE(has(error_of("pipeline: 3\n"), {"robot.yaml:1", "pipeline"}));
    EXPECT_TRUE(has(error_of("- 1\n- 2\n"), {"robot.yaml:1"}));
    EXPECT_TRUE(has(error_of("pipeline:\n  threads: [1\n"), {"robot.yaml:", "not valid YAML"}));
    EXPECT_TRUE(has(error_of("pipeline:\n  threads:\n"), {"robot.yaml:2", "pipeline.threads", "no value"}));
}

TEST(ConfigFile, AllThatIsWrongIsNamedAtOnceAndALine) {
    const std::string error =
        error_of("pipeline:\n  threads: 0\n  waiting_frames: many\nsensr: {host: a}\nodometry: {use_imu: maybe}\n");
    EXPECT_TRUE(has(error, {"robot.yaml:2: pipeline.threads", "\nrobot.yaml:3: pipeline.waiting_frames",
                            "\nrobot.yaml:4: unknown key 'sensr'", "\nrobot.yaml:5: odometry.use_imu"}));
    std::string garbage;
    for (int i = 0; i < 1000; ++i) garbage += fmt::format("key{}: 1\n", i);
    const std::string errors = error_of(garbage);
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 19) << "the first ones are enough";
}

TEST(ConfigFile, AFileThatCannotBeReadIsNamed) {
    Config config;
    EXPECT_THROW(apply_file(config, "/nowhere/robot.yaml"), ConfigError);
    EXPECT_THROW(apply_file(config, "/"), ConfigError);
    const test::TemporaryFolder folder;
    std::ofstream(folder.path() / "empty.yaml").close();
    EXPECT_NO_THROW(apply_file(config, folder.path() / "empty.yaml"));
}

TEST(ConfigFile, SettingsAreCheckedLikeFiles) {
    Config config;
    apply_setting(config, "pipeline.threads=4");
    apply_setting(config, "lcm.url=udpm://239.255.76.67:7667?ttl=1");
    apply_setting(config, "extrinsics.rotation_wxyz=[0, 0, 0, 1]");
    EXPECT_EQ(config.pipeline.threads, 4);
    EXPECT_EQ(config.lcm.url, "udpm://239.255.76.67:7667?ttl=1");
    EXPECT_EQ(config.extrinsics.rotation_wxyz, (std::array<double, 4>{0.0, 0.0, 0.0, 1.0}));
    EXPECT_TRUE(has(error_of_setting("pipeline.thread=4"), {"--set pipeline.thread=4", "pipeline.threads"}));
    EXPECT_TRUE(has(error_of_setting("pipeline.threads"), {"key=value"}));
    EXPECT_TRUE(has(error_of_setting("pipeline.threads=100"), {"pipeline.threads", "1 to 64"}));
    EXPECT_TRUE(has(error_of_setting("extrinsics.translation_m=[1, 2"), {"extrinsics.translation_m"}));
}

TEST(ConfigFile, WhatIsPrintedIsReadBack) {
    Config config;
    apply_setting(config, "pipeline.threads=7");
    apply_setting(config, "output.folder=a \"quoted\" \\name: #1");
    Config read;
    apply_yaml(read, to_yaml(config), "printed");
    EXPECT_EQ(to_yaml(read), to_yaml(config));
    EXPECT_EQ(read.output.folder, config.output.folder);
}

TEST(ConfigFile, TheDocumentedFileIsThatOfTheProgram) {
    std::ifstream stream("config/dlod.yaml");
    ASSERT_TRUE(stream) << "run the test in the source folder";
    std::ostringstream documented;
    documented << stream.rdbuf();
    EXPECT_TRUE(documented.str() == to_yaml(Config{})) << "run: dlod print-config > config/dlod.yaml";
}

TEST(Option, DefaultsLieInTheirRanges) {
    Config config;
    for (const auto& entry : list_options(config)) {
        const auto* option = std::get_if<Option>(&entry);
        if (option == nullptr) continue;
        EXPECT_FALSE(option->effect.empty()) << option->key;
        const std::string value = option->to_yaml();
        if (!option->is_list() && !std::holds_alternative<std::string*>(option->value)) {
            EXPECT_NO_THROW(option->assign(value))
                << option->key << " = " << value << ", valid: " << option->valid_values();
        }
    }
}

TEST(Presets, AreValidAndChosenFromTheMetadata) {
    for (const auto& preset : presets()) {
        Config config;
        for (const auto& setting : preset.settings)
            EXPECT_NO_THROW(apply_setting(config, setting)) << preset.product << preset.rows;
        driver::SensorInfo sensor;
        sensor.model.height = preset.rows;
        sensor.product_line = fmt::format("{}-{}-U1", preset.product, preset.rows);
        EXPECT_EQ(find_preset(sensor), &preset);
        sensor.product_line = fmt::format("OS-{}-{}-U1", preset.product.back(), preset.rows);
        EXPECT_EQ(find_preset(sensor), &preset);
    }
    driver::SensorInfo unknown;
    unknown.product_line = "VLS-128";
    unknown.model.height = 32;
    EXPECT_EQ(find_preset(unknown), nullptr);
}

}  // namespace
}  // namespace dlod::daemon
