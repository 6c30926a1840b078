#include "driver/metadata.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>

#include "tests/driver/synthetic_sensor.hpp"
#include "tests/support/test_data.hpp"

namespace dlod::driver {
namespace {

using nlohmann::json;
using test::synthetic_metadata;

/// The error's message, empty when the metadata is good.
std::string error_of(const std::string& text) {
    try {
        parse_metadata(text, "some.json");
        return {};
    } catch (const MetadataError& error) {
        return error.what();
    }
}

void expect_error(const std::string& text, const std::string& key, const std::string& about) {
    const std::string error = error_of(text);
    EXPECT_TRUE(error.starts_with("some.json: ")) << error;
    EXPECT_NE(error.find(key), std::string::npos) << error;
    EXPECT_NE(error.find(about), std::string::npos) << error;
}

bool has_warning(const SensorInfo& info, const std::string& key) {
    return std::any_of(info.warnings.begin(), info.warnings.end(),
                       [&](const std::string& w) { return w.find(key) != std::string::npos; });
}

TEST(Metadata, NestedFileIsReadWhole) {
    const SensorInfo info = parse_metadata(
        synthetic_metadata({.profile = "LEGACY", .rows = 64, .columns = 2048, .window_first = 1000, .window_last = 10}),
        "some.json");
    EXPECT_EQ(info.model.height, 64);
    EXPECT_EQ(info.model.width, 2048);
    EXPECT_EQ(info.model.column_window_first, 1000);
    EXPECT_EQ(info.model.column_window_last, 10);
    EXPECT_DOUBLE_EQ(info.model.frame_period_s, 0.1);
    EXPECT_NEAR(info.model.altitude_rad[0], 22.5 * std::numbers::pi / 180.0, 1e-6);
    EXPECT_NEAR(info.model.azimuth_offset_rad[3], -4.2 * std::numbers::pi / 180.0, 1e-6);
    EXPECT_EQ(info.model.pixel_shift[0], 24);
    EXPECT_EQ(info.model.pixel_shift[3], 24 - 48);
    EXPECT_FLOAT_EQ(info.model.beam_origin_m, 0.015806F);
    EXPECT_NEAR(info.model.T_sensor_lidar.translation().z(), 0.03618, 1e-12);
    EXPECT_NEAR(info.model.T_sensor_imu.translation().y(), -0.011775, 1e-12);
    EXPECT_EQ(info.format, find_packet_format("LEGACY"));
    EXPECT_EQ(info.product_line, "OS-1-64");
    EXPECT_EQ(info.serial(), 122201000998U);
    EXPECT_EQ(info.firmware, "v2.5.0");
    EXPECT_EQ(info.lidar_mode, "2048x10");
    EXPECT_EQ(info.timestamp_mode, "TIME_FROM_INTERNAL_OSC");
    EXPECT_EQ(info.init_id, 0x123456U);
    EXPECT_EQ(info.lidar_port, 7502);
    EXPECT_EQ(info.imu_port, 7503);
    EXPECT_TRUE(info.warnings.empty()) << info.warnings[0];
}

TEST(Metadata, UnknownProfileIsNamedWithTheKnownOnes) {
    const std::string text = synthetic_metadata({.profile = "LEGACY"});
    json file = json::parse(text);
    file["lidar_data_format"]["udp_profile_lidar"] = "FIVE_WORD_PIXEL";
    expect_error(file.dump(), "lidar_data_format.udp_profile_lidar", "FIVE_WORD_PIXEL");
    expect_error(file.dump(), "known are", known_packet_formats());
}

TEST(Metadata, MissingAndContradictoryFieldsAreErrorsThatNameTheKey) {
    struct Case {
        std::string key;
        std::string about;
        std::function<void(json&)> damage;
    };
    const std::vector<Case> cases{
        {"beam_intrinsics.beam_altitude_angles", "missing",
         [](json& j) { j["beam_intrinsics"].erase("beam_altitude_angles"); }},
        {"beam_intrinsics.beam_altitude_angles", "15 angles",
         [](json& j) { j["beam_intrinsics"]["beam_altitude_angles"].erase(0); }},
        {"beam_intrinsics.beam_azimuth_angles[2]", "number",
         [](json& j) { j["beam_intrinsics"]["beam_azimuth_angles"][2] = "1.0"; }},
        {"beam_intrinsics.beam_altitude_angles[1]", "at most 90",
         [](json& j) { j["beam_intrinsics"]["beam_altitude_angles"][1] = 91; }},
        {"beam_intrinsics.beam_altitude_angles", "0",
         [](json& j) {
             for (auto& a : j["beam_intrinsics"]["beam_altitude_angles"]) a = 0;
         }},
        {"beam_intrinsics.lidar_origin_to_beam_origin_mm", "number",
         [](json& j) { j["beam_intrinsics"]["lidar_origin_to_beam_origin_mm"] = true; }},
        {"beam_intrinsics.lidar_origin_to_beam_origin_mm", "contradicts beam_intrinsics.beam_to_lidar_transform",
         [](json& j) {
             j["beam_intrinsics"]["beam_to_lidar_transform"] = {1, 0, 0, 27.67, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
         }},
        {"config_params.lidar_mode", "missing", [](json& j) { j["config_params"].erase("lidar_mode"); }},
        {"config_params.lidar_mode", "fast", [](json& j) { j["config_params"]["lidar_mode"] = "fast"; }},
        {"config_params.lidar_mode", "1024x", [](json& j) { j["config_params"]["lidar_mode"] = "1024x"; }},
        {"config_params.lidar_mode", "contradicts lidar_data_format.fps",
         [](json& j) { j["lidar_data_format"]["fps"] = 20; }},
        {"config_params.udp_port_lidar", "1 to 65535", [](json& j) { j["config_params"]["udp_port_lidar"] = 70000; }},
        {"config_params.udp_port_imu", "1 to 65535", [](json& j) { j["config_params"]["udp_port_imu"] = "7503"; }},
        {"lidar_data_format.columns_per_frame", "missing",
         [](json& j) { j["lidar_data_format"].erase("columns_per_frame"); }},
        {"lidar_data_format.columns_per_frame", "contradicts lidar_mode",
         [](json& j) { j["lidar_data_format"]["columns_per_frame"] = 1024; }},
        {"lidar_data_format.columns_per_packet", "missing",
         [](json& j) { j["lidar_data_format"].erase("columns_per_packet"); }},
        {"lidar_data_format.columns_per_packet", "contradicts",
         [](json& j) { j["config_params"]["columns_per_packet"] = 8; }},
        {"lidar_data_format.columns_per_packet", "integer",
         [](json& j) { j["lidar_data_format"]["columns_per_packet"] = 16.5; }},
        {"lidar_data_format.pixels_per_column", "missing",
         [](json& j) { j["lidar_data_format"].erase("pixels_per_column"); }},
        {"lidar_data_format.pixels_per_column", "contradicts",
         [](json& j) { j["lidar_data_format"]["pixels_per_column"] = 32; }},
        {"lidar_data_format.pixel_shift_by_row", "missing",
         [](json& j) { j["lidar_data_format"].erase("pixel_shift_by_row"); }},
        {"lidar_data_format.pixel_shift_by_row", "15 numbers",
         [](json& j) { j["lidar_data_format"]["pixel_shift_by_row"].erase(3); }},
        {"lidar_data_format.column_window", "two columns",
         [](json& j) {
             j["lidar_data_format"]["column_window"] = {0, 10, 20};
         }},
        {"lidar_data_format.column_window[1]", "at most 511",
         [](json& j) {
             j["lidar_data_format"]["column_window"] = {0, 512};
         }},
        {"lidar_data_format.udp_profile_lidar", "contradicts config_params.udp_profile_lidar",
         [](json& j) { j["config_params"]["udp_profile_lidar"] = "LEGACY"; }},
        {"lidar_data_format.columns_per_frame", "missing", [](json& j) { j.erase("lidar_data_format"); }},
        {"data_format", "64 rows",
         [](json& j) {
             j = {{"lidar_mode", "512x10"}, {"beam_altitude_angles", {1, 2}}, {"beam_azimuth_angles", {0, 0}}};
         }},
        {"lidar_intrinsics.lidar_to_sensor_transform", "16 numbers",
         [](json& j) { j["lidar_intrinsics"]["lidar_to_sensor_transform"].erase(0); }},
        {"lidar_intrinsics.lidar_to_sensor_transform", "rigid",
         [](json& j) { j["lidar_intrinsics"]["lidar_to_sensor_transform"][0] = 1; }},
        {"imu_intrinsics.imu_to_sensor_transform", "rigid",
         [](json& j) { j["imu_intrinsics"]["imu_to_sensor_transform"][15] = 2; }},
        {"outermost", "object",
         [](json& j) {
             j = json::array({1, 2});
         }},
    };
    for (const Case& c : cases) {
        json file = json::parse(synthetic_metadata({}));
        c.damage(file);
        expect_error(file.dump(), c.key, c.about);
    }
    expect_error("{\"beam", "not a JSON file", "");
    expect_error("", "not a JSON file", "");
    EXPECT_THROW(load_metadata("/nonexistent/some.json"), MetadataError);
}

TEST(Metadata, WhatIsNotNeededIsAWarning) {
    json file = json::parse(synthetic_metadata({}));
    file.erase("calibration_status");
    file.erase("sensor_info");
    file["lidar_data_format"]["udp_profile_imu"] = "ACCEL32_GYRO32_NMEA";
    const SensorInfo info = parse_metadata(file.dump(), "some.json");
    EXPECT_TRUE(has_warning(info, "some.json: calibration_status"));
    EXPECT_TRUE(has_warning(info, "sensor_info.prod_sn"));
    EXPECT_TRUE(has_warning(info, "sensor_info.prod_line"));
    EXPECT_TRUE(has_warning(info, "ACCEL32_GYRO32_NMEA"));
    EXPECT_EQ(info.serial(), 0U);
    EXPECT_EQ(info.description(), "sensor of an unknown product line " + info.lidar_mode + " " + info.profile_name);
}

TEST(Metadata, WhatIsNoMetadataFileIsNamed) {
    const auto error_of_file = [](const std::filesystem::path& path) {
        try {
            load_metadata(path);
            return std::string();
        } catch (const MetadataError& error) {
            return std::string(error.what());
        }
    };
    EXPECT_EQ(error_of_file("/"), "/: is a folder, not the sensor's metadata file");
    EXPECT_EQ(error_of_file("/nowhere/a.json"), "/nowhere/a.json: cannot be read: No such file or directory");
    EXPECT_EQ(error_of_file("/dev/null"), "/dev/null: is empty");
    EXPECT_EQ(error_of("\xff\n\x1b\x01").find_first_of("\n\x1b\x01"), std::string::npos);
}

TEST(Metadata, TextsAreFitForTheLog) {
    json metadata = json::parse(synthetic_metadata({}));
    metadata["sensor_info"]["build_rev"] = "v3.1.0\nMAINPID=1\x1b[31m\u00e9" + std::string(100'000, 'x');
    const SensorInfo info = parse_metadata(metadata.dump(), "some.json");
    EXPECT_TRUE(info.firmware.starts_with("v3.1.0?MAINPID=1?[31m?")) << info.firmware;
    EXPECT_LT(info.firmware.size(), 110U);
}

TEST(Metadata, ReducedFilesGetTheDefaultsOfTheirProductLine) {
    struct Expected {
        std::string product_line;
        double beam_origin_m;
        double lidar_height_m;
    };
    for (const Expected& expected : {Expected{"OS-0-128", 0.02767, 0.03618}, Expected{"OS-1-64", 0.015806, 0.03618},
                                     Expected{"OS-2-32-U0", 0.013762, 0.074296}}) {
        json file = json::parse(synthetic_metadata({}));
        file["sensor_info"]["prod_line"] = expected.product_line;
        file["beam_intrinsics"].erase("lidar_origin_to_beam_origin_mm");
        file.erase("lidar_intrinsics");
        file.erase("imu_intrinsics");
        file["config_params"].erase("udp_port_lidar");
        file["config_params"].erase("udp_port_imu");
        const SensorInfo info = parse_metadata(file.dump(), "some.json");
        EXPECT_NEAR(info.model.beam_origin_m, expected.beam_origin_m, 1e-7);
        EXPECT_NEAR(info.model.T_sensor_lidar.translation().z(), expected.lidar_height_m, 1e-12);
        EXPECT_EQ(info.model.T_sensor_lidar.linear()(0, 0), -1.0);
        EXPECT_NEAR(info.model.T_sensor_imu.translation().x(), 0.006253, 1e-12);
        EXPECT_EQ(info.lidar_port, 7502);
        EXPECT_EQ(info.imu_port, 7503);
        for (const char* key : {"lidar_origin_to_beam_origin_mm", "lidar_to_sensor_transform",
                                "imu_to_sensor_transform", "udp_port_lidar", "udp_port_imu"}) {
            EXPECT_TRUE(has_warning(info, key)) << key;
        }
    }
}

TEST(Metadata, BeamOriginFromTheTransformOfADome) {
    json file = json::parse(synthetic_metadata({}));
    file["beam_intrinsics"].erase("lidar_origin_to_beam_origin_mm");
    file["beam_intrinsics"]["beam_to_lidar_transform"] = {1, 0, 0, 4, 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 0, 1};
    const SensorInfo info = parse_metadata(file.dump(), "some.json");
    EXPECT_FLOAT_EQ(info.model.beam_origin_m, 0.004F);
    EXPECT_FLOAT_EQ(info.model.beam_origin_height_m, 0.003F);
    EXPECT_TRUE(info.warnings.empty());
}

struct Firmware {
    int rows;
    int columns;
    int rate_hz;
    std::string profile;
    std::string product_line;
    int lidar_port;
    std::size_t warnings;
};

TEST(Metadata, EveryFirmwareIsRead) {
    const std::map<std::string, Firmware> files{
        {"metadata/1_12_os1-991937000062-64_legacy.json", {64, 1024, 10, "LEGACY", "OS-1-64", 7502, 4}},
        {"metadata/2_0_0_os1-991913000010-64.json", {64, 1024, 10, "LEGACY", "OS-1-64", 55426, 1}},
        {"metadata/2_2_os-992119000444-128.json", {128, 1024, 10, "LEGACY", "OS-1-128", 7502, 0}},
        {"metadata/2_5_0_os-992146000760-128.json", {128, 1024, 10, "RNG19_RFL8_SIG16_NIR16", "OS-1-128", 7502, 0}},
        {"metadata/3_0_1_os-122246000293-128.json",
         {128, 1024, 10, "RNG19_RFL8_SIG16_NIR16_DUAL", "OS-1-128", 7502, 0}},
        {"OS-0-128-U1_v2.3.0_1024x10.json", {128, 1024, 10, "RNG15_RFL8_NIR8", "OS-0-128", 7502, 0}},
        {"OS-0-32-U1_v2.2.0_1024x10.json", {32, 1024, 10, "RNG19_RFL8_SIG16_NIR16_DUAL", "OS-0-32-U1", 7502, 0}},
        {"OS-1-128_v2.3.0_1024x10.json", {128, 1024, 10, "RNG15_RFL8_NIR8", "OS-1-128", 7502, 0}},
        {"OS-2-32-U0_v2.0.0_1024x10.json", {32, 1024, 20, "LEGACY", "OS-2-32-U0", 7502, 2}},
        {"duplicate_id.json", {128, 1024, 10, "RNG15_RFL8_NIR8", "OS-2-128", 34636, 0}},
        {"empty_pcap.json", {128, 512, 10, "RNG19_RFL8_SIG16_NIR16_DUAL", "OS-2-128", 7502, 0}},
        {"windowed_frame1_0.json", {128, 512, 10, "RNG15_RFL8_NIR8", "OS-0-128", 53750, 0}},
    };
    for (const auto& [name, expected] : files) {
        const auto path = dlod::test::data_path("ouster/" + name);
        if (!path) GTEST_SKIP() << "no data/ouster/" << name;
        const SensorInfo info = load_metadata(*path);
        EXPECT_EQ(info.model.height, expected.rows) << name;
        EXPECT_EQ(info.model.width, expected.columns) << name;
        EXPECT_EQ(info.frame_rate_hz, expected.rate_hz) << name;
        EXPECT_EQ(info.profile_name, expected.profile) << name;
        EXPECT_EQ(info.product_line, expected.product_line) << name;
        EXPECT_EQ(info.lidar_port, expected.lidar_port) << name;
        EXPECT_EQ(info.columns_per_packet, 16) << name;
        EXPECT_NE(info.serial(), 0U) << name;
        std::string warnings;
        for (const std::string& warning : info.warnings) warnings += warning + "\n";
        EXPECT_EQ(info.warnings.size(), expected.warnings) << warnings;
    }
}

TEST(Metadata, Firmware1HasItsNominalShifts) {
    const auto path = dlod::test::data_path("ouster/metadata/1_12_os1-991937000062-64_legacy.json");
    if (!path) GTEST_SKIP() << "no data/ouster/metadata";
    const SensorInfo info = load_metadata(*path);
    for (std::size_t row = 0; row < 64; ++row)
        EXPECT_EQ(info.model.pixel_shift[row], 18 - 6 * static_cast<int>(row % 4)) << row;
    EXPECT_FLOAT_EQ(info.model.beam_origin_m, 0.012163F);
    EXPECT_EQ(info.model.column_window_last, 1023);
}

TEST(Metadata, MalformedFilesHaveTheseOutcomes) {
    // Empty: is read, since nothing that is needed is missing.
    const std::map<std::string, std::string> outcomes{
        {"complete_but_all_zeros_legacy.json", "beam_altitude_angles: all angles are 0"},
        {"garbled_legacy_and_nonlegacy.json", "config_params.lidar_mode: is missing"},
        {"incomplete_data_format_legacy.json", "data_format.columns_per_frame: is missing"},
        {"incomplete_data_format_nonlegacy.json", "lidar_data_format.pixels_per_column: is missing"},
        {"incomplete_no_calref_nonlegacy.json", ""},
        {"incomplete_no_sensor_info_nonlegacy.json", ""},
        {"incorrect_nbeam_angles_legacy_113.json",
         "beam_altitude_angles: has 63 angles, but beam_azimuth_angles has 64"},
        {"legacy_with_calibration_status.json", ""},
    };
    const auto folder = dlod::test::data_path("ouster/metadata/malformed");
    if (!folder) GTEST_SKIP() << "no data/ouster/metadata/malformed";
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(*folder)) {
        ++files;
        const std::string name = entry.path().filename().string();
        ASSERT_TRUE(outcomes.contains(name)) << name;
        std::string error;
        try {
            load_metadata(entry.path());
        } catch (const MetadataError& e) {
            error = e.what();
        }
        const std::string expected = outcomes.at(name).empty() ? "" : entry.path().string() + ": " + outcomes.at(name);
        EXPECT_EQ(error.substr(0, expected.size()), expected) << error;
        EXPECT_EQ(error.empty(), expected.empty()) << error;
    }
    EXPECT_EQ(files, static_cast<int>(outcomes.size()));
}

/// A damaged copy: bytes flipped, cut, repeated; or a value of the JSON tree replaced.
std::string mutate(const std::string& text, std::mt19937& random) {
    std::string out = text;
    const auto somewhere = [&] { return static_cast<std::size_t>(random() % out.size()); };
    switch (random() % 5) {
        case 0:
            for (auto n = random() % 8 + 1; n > 0; --n) out[somewhere()] = static_cast<char>(random() % 256);
            return out;
        case 1:
            return out.substr(0, somewhere());
        case 2: {
            const std::size_t from = somewhere();
            return out.insert(somewhere(), out.substr(from, random() % 64));
        }
        case 3: {
            const std::size_t digit = out.find_first_of("0123456789", somewhere());
            static const char* numbers[] = {"-",  "1e999", "-1e9", "99999999999999999999", "0", "null", "\"\"",
                                            "[]", "{}",    "1.5"};
            return digit == std::string::npos ? out : out.replace(digit, 1, numbers[random() % 10]);
        }
        default:
            return out.erase(somewhere(), random() % 256);
    }
}

TEST(Metadata, MutatedFilesAreReadOrRefusedButNeverHarmful) {
    const char* requested = std::getenv("DLOD_FUZZ_ITERATIONS");
    const int iterations = requested == nullptr ? 2000 : std::max(2000, std::atoi(requested) / 100);
    std::vector<std::string> originals{synthetic_metadata({}),
                                       synthetic_metadata({.profile = "LEGACY", .rows = 128, .columns = 2048})};
    if (const auto path = dlod::test::data_path("ouster/OS-0-32-U1_v2.2.0_1024x10.json")) {
        std::ifstream file(*path);
        originals.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    }
    std::mt19937 random(7);
    int refused = 0;
    for (int i = 0; i < iterations; ++i) {
        std::string text = originals[random() % originals.size()];
        for (auto n = random() % 3 + 1; n > 0 && !text.empty(); --n) text = mutate(text, random);
        try {
            const SensorInfo info = parse_metadata(text, "some.json");
            ASSERT_NE(info.format, nullptr);
            ASSERT_LE(info.layout().packet_bytes(), 65507U);
            ASSERT_EQ(info.model.altitude_rad.size(), static_cast<std::size_t>(info.model.height));
            ASSERT_EQ(info.model.pixel_shift.size(), static_cast<std::size_t>(info.model.height));
            ASSERT_LT(std::max(info.model.column_window_first, info.model.column_window_last), info.model.width);
        } catch (const MetadataError& error) {
            ++refused;
            ASSERT_TRUE(std::string(error.what()).starts_with("some.json: "));
        }
    }
    EXPECT_GT(refused, iterations / 4);
    EXPECT_LT(refused, iterations);
}

}  // namespace
}  // namespace dlod::driver
