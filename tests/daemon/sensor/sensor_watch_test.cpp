#include "daemon/sensor/sensor_watch.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "daemon/config/option.hpp"
#include "daemon/sensor/metadata_cache.hpp"
#include "daemon/service/log.hpp"
#include "driver/metadata.hpp"
#include "tests/support/fake_sensor.hpp"

namespace dlod::daemon {
namespace {

using namespace std::chrono_literals;
using Stream = SensorWatch::Stream;

constexpr SensorWatch::Timing kFast{.calm = 20ms, .troubled = 10ms, .timeout = 500ms, .contest = 100ms};

class SensorWatchTest : public testing::Test {
  protected:
    SensorWatchTest() { config_.host = sensor_.host(); }

    SensorWatch watch() const { return {config_, std::nullopt, folder_.path(), kFast}; }

    static bool eventually(const std::function<bool()>& condition) {
        const auto deadline = std::chrono::steady_clock::now() + 5s;
        while (!condition()) {
            if (std::chrono::steady_clock::now() > deadline) return false;
            std::this_thread::sleep_for(2ms);
        }
        return true;
    }
    static std::optional<SensorMetadata> awaited(SensorWatch& watch) {
        std::optional<SensorMetadata> metadata;
        eventually([&] { return (metadata = watch.take_metadata()).has_value(); });
        return metadata;
    }
    static std::string serial_of(const std::optional<SensorMetadata>& metadata) {
        return metadata ? driver::parse_metadata(metadata->json, metadata->name).serial_number : "nothing";
    }
    static bool says(const SensorWatch& watch, const std::string& text) {
        return eventually([&] { return watch.trouble().find(text) != std::string::npos; });
    }

    test::TemporaryFolder folder_;
    test::FakeSensor sensor_;
    SensorConfig config_;
};

TEST_F(SensorWatchTest, GivesTheFirstMetadataOnceAndKeepsThem) {
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    std::this_thread::sleep_for(100ms);
    EXPECT_FALSE(watch.take_metadata().has_value()) << "nothing has changed";
    EXPECT_TRUE(MetadataCache(folder_.path(), config_.host).load().has_value());
    EXPECT_EQ(sensor_.settings_made(), 0) << "nothing is asked for";
}

TEST_F(SensorWatchTest, ASensorThatIsSlowToComeUpIsAwaited) {
    sensor_.unplug();
    SensorWatch watch = this->watch();
    EXPECT_TRUE(says(watch, sensor_.host()));
    EXPECT_FALSE(watch.take_metadata().has_value());
    sensor_.plug_in();
    EXPECT_TRUE(says(watch, "INITIALIZING"));
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    EXPECT_TRUE(
        eventually([&] { return watch.trouble().empty() || watch.trouble().find("INIT") == std::string::npos; }));
}

TEST_F(SensorWatchTest, AKeptFileThatIsDamagedIsNamedOnce) {
    MetadataCache(folder_.path(), config_.host).store("{\"beam_altitude");
    sensor_.answers = false;
    set_up_log(2);
    testing::internal::CaptureStderr();
    {
        SensorWatch watch = this->watch();
        EXPECT_TRUE(says(watch, sensor_.host()));
        std::this_thread::sleep_for(200ms);
        EXPECT_FALSE(watch.take_metadata().has_value());
    }
    const std::string log = testing::internal::GetCapturedStderr();
    const auto at = log.find("the file is not used");
    EXPECT_NE(at, std::string::npos) << log;
    EXPECT_EQ(log.find("the file is not used", at + 1), std::string::npos) << log;
}

TEST_F(SensorWatchTest, WhatItGaveLastTimeServesWhileItDoesNotAnswer) {
    MetadataCache(folder_.path(), config_.host).store(test::SyntheticCapture::metadata({.serial_number = 99}));
    sensor_.answers = false;
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "99");
    sensor_.answers = true;
    EXPECT_EQ(serial_of(awaited(watch)), "123456") << "it was replaced meanwhile";
}

TEST_F(SensorWatchTest, AKeptFileThatIsDamagedIsNotUsed) {
    MetadataCache(folder_.path(), config_.host).store("{\"beam_altitude_angles\": [1");
    sensor_.answers = false;
    SensorWatch watch = this->watch();
    EXPECT_TRUE(says(watch, sensor_.host()));
    EXPECT_FALSE(watch.take_metadata().has_value());
}

TEST_F(SensorWatchTest, ARestartAloneChangesNothing) {
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    sensor_.restart();
    watch.observe(Stream::kUnfit);
    std::this_thread::sleep_for(400ms);  // it initializes for a quarter of a second
    EXPECT_FALSE(watch.take_metadata().has_value());
}

TEST_F(SensorWatchTest, AnotherSensorAnotherModelAndNewFirmwareAreToldOnce) {
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    const test::SyntheticSensor others[] = {
        {.serial_number = 2}, {.rows = 64, .serial_number = 2}, {.rows = 64, .serial_number = 2, .firmware = "v3.1.0"}};
    for (const auto& other : others) {
        sensor_.become(other);
        const auto metadata = awaited(watch);
        ASSERT_TRUE(metadata.has_value());
        const auto info = driver::parse_metadata(metadata->json, "");
        EXPECT_EQ(info.model.height, other.rows);
        EXPECT_EQ(info.serial_number, "2");
        EXPECT_NE(info.firmware.find(other.firmware), std::string::npos);
        EXPECT_FALSE(watch.take_metadata().has_value());
    }
}

TEST_F(SensorWatchTest, ADestinationTakenByAnotherHostIsNamed) {
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    sensor_.set({{"udp_dest", "10.0.0.9"}});
    watch.observe(Stream::kSilent);
    EXPECT_TRUE(says(watch, "sends to 10.0.0.9, this host is 127.0.0.1"));
    EXPECT_EQ(sensor_.settings_made(), 0) << "it is not for dlod to change it, unless asked";
    sensor_.set({{"udp_dest", "127.0.0.1"}});
    watch.observe(Stream::kGood);
    EXPECT_TRUE(eventually([&] { return watch.trouble().empty(); }));
}

TEST_F(SensorWatchTest, MakesOnlyTheSettingsThatAreAskedForAndNotInForce) {
    config_.configure.udp_dest = "@auto";
    config_.configure.timestamp_mode = "TIME_FROM_PTP_1588";
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    EXPECT_EQ(sensor_.settings()["timestamp_mode"], "TIME_FROM_PTP_1588");
    EXPECT_EQ(sensor_.settings_made(), 1);
    std::this_thread::sleep_for(300ms);
    EXPECT_EQ(sensor_.settings_made(), 1) << "all is in force";
    SensorWatch second = this->watch();
    EXPECT_EQ(serial_of(awaited(second)), "123456");
    EXPECT_EQ(sensor_.settings_made(), 1) << "a start does not restart the sensor's stream without need";
}

TEST_F(SensorWatchTest, TakesItsDestinationBackEverMoreSlowly) {
    config_.configure.udp_dest = "@auto";
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 1; i <= 3; ++i) {
        sensor_.set({{"udp_dest", "10.0.0.9"}});
        EXPECT_TRUE(eventually([&] { return sensor_.settings_made() == i; }));
        EXPECT_EQ(sensor_.settings()["udp_dest"], "127.0.0.1");
    }
    // A quarter of a second of initialization each time, and pauses of 100 and 200 ms at least.
    EXPECT_GE(std::chrono::steady_clock::now() - begin, 300ms);
}

TEST_F(SensorWatchTest, NewSettingsAreMadeAtRunTime) {
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    config_.configure.lidar_mode = "1024x10";
    watch.configure(config_);
    const auto metadata = awaited(watch);
    ASSERT_TRUE(metadata.has_value());
    EXPECT_EQ(driver::parse_metadata(metadata->json, "").model.width, 1024);
}

TEST_F(SensorWatchTest, AConfiguredFileStaysAndTheMismatchIsNamed) {
    const SensorMetadata file{test::SyntheticCapture::metadata({.serial_number = 5}), "my_sensor.json"};
    SensorWatch watch(config_, file, folder_.path(), kFast);
    EXPECT_EQ(serial_of(awaited(watch)), "5");
    EXPECT_TRUE(says(watch, "my_sensor.json: serial number 123456 instead of 5"));
    EXPECT_FALSE(watch.take_metadata().has_value());
}

TEST_F(SensorWatchTest, ASensorInStandbyIsNamed) {
    sensor_.become({.status = "STANDBY"});
    SensorWatch watch = this->watch();
    EXPECT_EQ(serial_of(awaited(watch)), "123456");
    EXPECT_TRUE(says(watch, "standby"));
}

TEST_F(SensorWatchTest, TheEndDoesNotWaitForAnAnswer) {
    config_.host = "192.0.2.1";  // an address that nobody has: the connection hangs
    const auto begin = std::chrono::steady_clock::now();
    {
        SensorWatch watch(config_, std::nullopt, "", {.timeout = 5s});
        std::this_thread::sleep_for(50ms);
    }
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);
}

TEST(ConfiguredMetadata, AreReadOrNamed) {
    SensorConfig config;
    EXPECT_THROW(configured_metadata(config), ConfigError);
    config.host = "sensor.local";
    EXPECT_FALSE(configured_metadata(config).has_value());
    const test::TemporaryFolder folder;
    test::SyntheticCapture(1).write(folder.path());
    config.metadata = (folder.path() / "drive.json").string();
    EXPECT_EQ(configured_metadata(config)->name, config.metadata);
    config.metadata = "/nowhere/sensor.json";
    EXPECT_THROW(configured_metadata(config), driver::MetadataError);
}

}  // namespace
}  // namespace dlod::daemon
