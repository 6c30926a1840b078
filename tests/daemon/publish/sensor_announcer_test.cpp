#include "daemon/publish/sensor_announcer.hpp"

#include <gtest/gtest.h>

#include "core/types/lie.hpp"
#include "tests/support/recording_bus.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(SensorAnnouncer, TellsAtTheStartAndEveryTenSeconds) {
    const auto sensor = driver::parse_metadata(test::SyntheticCapture::metadata(), "sensor.json");
    test::RecordingBus bus;
    SensorAnnouncer announcer(bus, sensor, Eigen::Isometry3d::Identity(), "A_");
    for (int second = 5; second <= 40; ++second) announcer.announce_if_due(second * kSecond, second);
    std::vector<std::int64_t> times;
    for (const auto& message : bus.decoded<sensor_t>("A_SENSOR")) times.push_back(message.utime);
    EXPECT_EQ(times, (std::vector<std::int64_t>{5, 15, 25, 35}));
}

TEST(SensorAnnouncer, TheMessageSaysWhatTheMetadataSay) {
    driver::SensorInfo sensor = driver::parse_metadata(test::SyntheticCapture::metadata(), "sensor.json");
    sensor.model.T_sensor_lidar = make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, 1.0)), Eigen::Vector3d(0.1, 0.2, 0.3));
    const Eigen::Isometry3d T_base_sensor =
        make_pose(so3_exp(Eigen::Vector3d(0.3, 0.0, 0.0)), Eigen::Vector3d(1.0, 2.0, 3.0));
    test::RecordingBus bus;
    SensorAnnouncer announcer(bus, sensor, T_base_sensor, "DLOD_");
    announcer.announce_if_due(0, 7);
    const auto m = bus.decoded<sensor_t>("DLOD_SENSOR").at(0);
    EXPECT_EQ(m.product_line, "OS-0-32");
    EXPECT_EQ(m.serial_number, "123456");
    EXPECT_EQ(m.lidar_mode, "512x10");
    EXPECT_EQ(m.profile, "RNG15_RFL8_NIR8");
    EXPECT_EQ(m.imu_profile, "LEGACY");
    EXPECT_EQ(m.rows, test::SyntheticCapture::kRows);
    EXPECT_EQ(m.columns, test::SyntheticCapture::kColumns);
    EXPECT_EQ(m.first_measurement, 0);
    EXPECT_EQ(m.last_measurement, test::SyntheticCapture::kColumns - 1);
    EXPECT_DOUBLE_EQ(m.frame_rate, 10.0);
    EXPECT_EQ(m.beam_altitude, sensor.model.altitude_rad);
    EXPECT_EQ(m.beam_azimuth, sensor.model.azimuth_offset_rad);
    EXPECT_EQ(std::vector<int>(m.pixel_shift.begin(), m.pixel_shift.end()), sensor.model.pixel_shift);
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            EXPECT_EQ(m.T_sensor_lidar[4 * row + column], sensor.model.T_sensor_lidar.matrix()(row, column));
            EXPECT_EQ(m.T_base_sensor[4 * row + column], T_base_sensor.matrix()(row, column));
        }
    }
}

TEST(SensorAnnouncer, TheLargestSensorFitsIntoADatagram) {
    driver::SensorInfo sensor = driver::parse_metadata(test::SyntheticCapture::metadata(), "sensor.json");
    sensor.model.height = 128;
    sensor.model.altitude_rad.resize(128);
    sensor.model.azimuth_offset_rad.resize(128);
    sensor.model.pixel_shift.resize(128);
    test::RecordingBus bus;
    SensorAnnouncer announcer(bus, sensor, Eigen::Isometry3d::Identity(), "DLOD_");
    announcer.announce_if_due(0, 7);
    EXPECT_EQ(announcer.failed(), 0U);
    EXPECT_EQ(bus.decoded<sensor_t>("DLOD_SENSOR").at(0).pixel_shift.size(), 128U);
}

}  // namespace
}  // namespace dlod::daemon
