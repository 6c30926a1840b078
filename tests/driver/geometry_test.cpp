#include "driver/geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "driver/metadata.hpp"
#include "tests/driver/synthetic_sensor.hpp"
#include "tests/support/test_data.hpp"

namespace dlod::driver {
namespace {

/// The sensor's formulas, word for word and in double precision: metres.
Eigen::Vector3d point(const SensorModel& sensor, int row, int measurement, std::uint32_t range_mm) {
    const auto i = static_cast<std::size_t>(row);
    const double theta = 2.0 * std::numbers::pi * (1.0 - static_cast<double>(measurement) / sensor.width);
    const double a = -static_cast<double>(sensor.azimuth_offset_rad[i]);
    const double p = sensor.altitude_rad[i];
    const double n = sensor.beam_origin_m;
    const double h = sensor.beam_origin_height_m;
    const double d = std::hypot(n, h);
    const double r = range_mm * 1e-3;
    const Eigen::Vector3d lidar((r - d) * std::cos(theta + a) * std::cos(p) + n * std::cos(theta),
                                (r - d) * std::sin(theta + a) * std::cos(p) + n * std::sin(theta),
                                (r - d) * std::sin(p) + h);
    return sensor.T_sensor_lidar * lidar;
}

void expect_within_a_millimetre(const SensorModel& sensor, const std::string& name) {
    Frame frame(sensor);
    std::mt19937 random(1);
    std::vector<std::uint32_t> ranges{0, 1, 8, 500, 45'000, 262'136, 524'287};
    for (std::size_t pixel = 0; pixel < sensor.pixels(); ++pixel) {
        const auto choice = random() % 10;
        frame.raw.range_mm[pixel] =
            static_cast<std::uint32_t>(choice < ranges.size() ? ranges[choice] : random() % 200'000);
        frame.cloud.x[pixel] = 77.0F;
    }
    Geometry(sensor).process(frame);
    double largest_error = 0.0;
    for (int row = 0; row < sensor.height; ++row) {
        for (int column = 0; column < sensor.width; ++column) {
            const std::uint32_t range = frame.raw.range_mm(row, column);
            const Eigen::Vector3d expected = range == 0 ? Eigen::Vector3d(0.0, 0.0, 0.0)
                                                        : point(sensor, row, sensor.measurement_of(row, column), range);
            const Eigen::Vector3d got(frame.cloud.x(row, column), frame.cloud.y(row, column),
                                      frame.cloud.z(row, column));
            const double distance_error = std::abs(frame.cloud.range_m(row, column) - expected.norm());
            largest_error = std::max({largest_error, (got - expected).norm(), distance_error});
            if (range == 0) {
                ASSERT_TRUE(got.isZero(0.0) && frame.cloud.range_m(row, column) == 0.0F);
            }
        }
    }
    EXPECT_LT(largest_error, 1e-3) << name;
}

TEST(Geometry, FollowsTheFormulasForSyntheticSensors) {
    for (const int columns : {512, 1024, 2048, 4096}) {
        const test::SyntheticSensor sensor({.rows = 32, .columns = columns});
        expect_within_a_millimetre(sensor.info().model, std::to_string(columns));
    }
}

TEST(Geometry, AppliesAnyRigidTransformAndBeamHeight) {
    const test::SyntheticSensor sensor;
    SensorModel model = sensor.info().model;
    model.T_sensor_lidar = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, -2.0, 0.5).normalized());
    model.T_sensor_lidar.translation() = Eigen::Vector3d(0.1, -0.2, 0.3);
    model.beam_origin_height_m = 0.02F;
    expect_within_a_millimetre(model, "turned");
}

TEST(Geometry, FollowsTheFormulasForEveryMetadataFile) {
    const auto folder = dlod::test::data_path("ouster");
    if (!folder) GTEST_SKIP() << "no data/ouster";
    int files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*folder)) {
        const std::string path = entry.path().string();
        if (entry.path().extension() != ".json" || path.ends_with("_digest.json") ||
            path.find("malformed") != std::string::npos)
            continue;
        expect_within_a_millimetre(load_metadata(path).model, path);
        ++files;
    }
    EXPECT_EQ(files, 12);
}

TEST(Geometry, ABeamStraightAheadPointsForward) {
    // Measurement 0 of a beam without offsets: the lidar frame's +x, which is the sensor's -x.
    SensorModel sensor;
    sensor.height = 1;
    sensor.width = 512;
    sensor.altitude_rad = {0.0F};
    sensor.azimuth_offset_rad = {0.0F};
    sensor.pixel_shift = {0};
    sensor.T_sensor_lidar.linear() = Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
    Frame frame(sensor);
    frame.raw.range_mm(0, 0) = 10'000;
    frame.raw.range_mm(0, 128) = 10'000;  // a quarter of a turn later: clockwise seen from above, so the sensor's +y
    Geometry(sensor).process(frame);
    EXPECT_NEAR(frame.cloud.x(0, 0), -10.0, 1e-5);
    EXPECT_NEAR(frame.cloud.y(0, 0), 0.0, 1e-5);
    EXPECT_NEAR(frame.cloud.x(0, 128), 0.0, 1e-5);
    EXPECT_NEAR(frame.cloud.y(0, 128), 10.0, 1e-5);
    EXPECT_EQ(frame.cloud.range_m(0, 1), 0.0F);
}

}  // namespace
}  // namespace dlod::driver
