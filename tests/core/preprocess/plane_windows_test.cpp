#include "core/preprocess/plane_windows.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/simulated_drive.hpp"

namespace dlod::test {
namespace {

/// @param beam_origin_m windows know one origin for all their beams: 0 makes that exact
SensorModel staggered_sensor(int height, int width, float beam_origin_m = 0.0F) {
    DriveOptions options;
    options.height = height;
    options.width = width;
    SensorModel sensor = SimulatedDrive(
                             {}, [](double) { return Eigen::Isometry3d::Identity(); }, options)
                             .sensor();
    sensor.beam_origin_m = beam_origin_m;
    return sensor;
}

void receive_all_columns(Frame& frame) {
    std::fill(frame.columns.valid.begin(), frame.columns.valid.end(), std::uint8_t{1});
    frame.header.valid_columns = static_cast<int>(frame.columns.valid.size());
}

struct Beam {
    Eigen::Vector3d origin, direction;  ///< sensor frame
};

/// Origin and direction of a pixel's beam after the sensor's documented geometry.
Beam beam_of(const SensorModel& sensor, int row, int column) {
    const auto r = static_cast<std::size_t>(row);
    const double theta = 2.0 * std::numbers::pi * (1.0 - sensor.measurement_of(row, column) / double(sensor.width));
    const double azimuth = theta - static_cast<double>(sensor.azimuth_offset_rad[r]);
    const double altitude = static_cast<double>(sensor.altitude_rad[r]);
    const double n = static_cast<double>(sensor.beam_origin_m);
    return {
        sensor.T_sensor_lidar * Eigen::Vector3d(n * std::cos(theta), n * std::sin(theta), 0.0),
        sensor.T_sensor_lidar.linear() * Eigen::Vector3d(std::cos(azimuth) * std::cos(altitude),
                                                         std::sin(azimuth) * std::cos(altitude), std::sin(altitude))};
}

/// Ranges to the plane normal . p = offset, with noise; 0 where the beam does not meet it within 60 m.
void shoot_at_plane(const SensorModel& sensor, const Eigen::Vector3d& normal, double offset, double noise_m,
                    Frame& frame) {
    receive_all_columns(frame);
    std::mt19937_64 random(7);
    std::normal_distribution<double> gauss;
    for (int r = 0; r < sensor.height; ++r) {
        for (int c = 0; c < sensor.width; ++c) {
            const Beam beam = beam_of(sensor, r, c);
            const double along = normal.dot(beam.direction);
            const double range = along > 1e-3 ? (offset - normal.dot(beam.origin)) / along : 0.0;
            const bool hit = range > 0.3 && range < 60.0;
            const double measured =
                range + static_cast<double>(sensor.beam_origin_m) + (hit ? noise_m * gauss(random) : 0.0);
            frame.raw.range_mm(r, c) = hit ? static_cast<std::uint32_t>(std::lround(measured * 1000.0)) : 0U;
        }
    }
}

Eigen::Vector3d point_of(const SensorModel& sensor, const Frame& frame, int row, int column) {
    const Beam beam = beam_of(sensor, row, column);
    return beam.origin +
           (frame.raw.range_mm(row, column) * 1e-3 - static_cast<double>(sensor.beam_origin_m)) * beam.direction;
}

struct Window {
    Eigen::Vector3d normal;  ///< towards the sensor
    double deviation_m;      ///< of the ranges along the beams
    double range_m;          ///< where the middle beam meets the plane, from its origin
};

/// Eigen-decomposition of the covariance of the same 25 points.
Window slow_window(const SensorModel& sensor, const Frame& frame, int row, int column) {
    const int first = std::clamp(row - kWindowRadius, 0, sensor.height - kWindowSide);
    std::vector<Beam> beams;
    std::vector<Eigen::Vector3d> points;
    for (int r = first; r < first + kWindowSide; ++r) {
        for (int c = column - kWindowRadius; c <= column + kWindowRadius; ++c) {
            const int wrapped = (c + sensor.width) % sensor.width;
            beams.push_back(beam_of(sensor, r, wrapped));
            points.push_back(point_of(sensor, frame, r, wrapped));
        }
    }
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& p : points) mean += p / kWindowPixels;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const auto& p : points) covariance += (p - mean) * (p - mean).transpose() / kWindowPixels;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    Window window;
    window.normal = solver.eigenvectors().col(0);
    if (window.normal.dot(mean) > 0.0) window.normal *= -1.0;
    double squares = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double off = window.normal.dot(points[i] - mean) / window.normal.dot(beams[i].direction);
        squares += off * off / kWindowPixels;
    }
    window.deviation_m = std::sqrt(squares);
    const Beam center = beam_of(sensor, row, column);
    window.range_m = window.normal.dot(mean - center.origin) / window.normal.dot(center.direction);
    return window;
}

Eigen::Vector3d normal_of(const SensorModel& sensor, const PlaneWindows& windows, const PlaneRow& planes, int row,
                          int k, int step) {
    const auto i = static_cast<std::size_t>(k);
    const BeamFrame beam = windows.beam(row, sensor.measurement_of(row, k * step));
    const Eigen::Vector3f n = -(planes.inverse_range[i] * beam.direction + planes.slope_azimuth[i] * beam.along_row +
                                planes.slope_altitude[i] * beam.up);
    return n.normalized().cast<double>();
}

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

struct Errors {
    int windows = 0;
    double fast_angle2 = 0.0, slow_angle2 = 0.0;
    double fast_range2 = 0.0, slow_range2 = 0.0;
    double between_max_deg = 0.0;        ///< largest angle between fast and slow
    double between_range_max_m = 0.0;    ///< largest difference of the smoothed ranges
    double between_deviation_max = 0.0;  ///< largest difference of the deviations
};

Errors compare(const SensorModel& sensor, const Eigen::Vector3d& normal, double offset, const Frame& frame, int step) {
    PlaneWindows windows(sensor, step);
    windows.load(frame);
    PlaneRow planes;
    Errors errors;
    for (int row = 0; row < sensor.height; row += 5) {
        windows.fit_row(row, planes);
        for (int k = 0; k < windows.windows(); ++k) {
            const auto i = static_cast<std::size_t>(k);
            if (planes.inverse_range[i] <= 0.0F) continue;
            const Beam beam = beam_of(sensor, row, k * step);
            if (normal.dot(beam.direction) < 0.3) continue;  // grazing: nothing is known well
            const Window slow = slow_window(sensor, frame, row, k * step);
            const double truth_m = (offset - normal.dot(beam.origin)) / normal.dot(beam.direction);
            const Eigen::Vector3d n = normal_of(sensor, windows, planes, row, k, step);
            const double range_m = 1.0 / static_cast<double>(planes.inverse_range[i]);
            errors.fast_angle2 += std::pow(angle_deg(n, -normal), 2);
            errors.slow_angle2 += std::pow(angle_deg(slow.normal, -normal), 2);
            errors.fast_range2 += std::pow(range_m - truth_m, 2);
            errors.slow_range2 += std::pow(slow.range_m - truth_m, 2);
            errors.between_max_deg = std::max(errors.between_max_deg, angle_deg(n, slow.normal));
            errors.between_range_max_m = std::max(errors.between_range_max_m, std::abs(range_m - slow.range_m));
            errors.between_deviation_max = std::max(
                errors.between_deviation_max, std::abs(static_cast<double>(planes.deviation_m[i]) - slow.deviation_m));
            ++errors.windows;
        }
    }
    return errors;
}

struct Plane {
    Eigen::Vector3d normal;  ///< away from the sensor
    double offset_m;
};

class PlanesAround : public testing::TestWithParam<Plane> {};

TEST_P(PlanesAround, WithoutNoiseAreThoseOfTheEigenDecomposition) {
    const SensorModel sensor = staggered_sensor(64, 1024);
    Frame frame(sensor);
    const Eigen::Vector3d normal = GetParam().normal.normalized();
    shoot_at_plane(sensor, normal, GetParam().offset_m, 0.0, frame);
    const Errors e = compare(sensor, normal, GetParam().offset_m, frame, 4);
    ASSERT_GT(e.windows, 200);
    // What remains is the rounding of the ranges to millimetres.
    EXPECT_LT(e.between_max_deg, 0.5);
    EXPECT_LT(e.between_range_max_m, 5e-4);
    EXPECT_LT(e.between_deviation_max, 3e-4);
    EXPECT_LT(std::sqrt(e.fast_angle2 / e.windows), 0.2);
    EXPECT_LT(std::sqrt(e.fast_range2 / e.windows), 3e-4);
}

TEST_P(PlanesAround, WithNoiseAreAtLeastAsGoodAsTheEigenDecomposition) {
    const SensorModel sensor = staggered_sensor(64, 1024);
    Frame frame(sensor);
    const Eigen::Vector3d normal = GetParam().normal.normalized();
    shoot_at_plane(sensor, normal, GetParam().offset_m, 0.01, frame);
    const Errors e = compare(sensor, normal, GetParam().offset_m, frame, 4);
    ASSERT_GT(e.windows, 200);
    EXPECT_LE(e.fast_angle2, 1.05 * e.slow_angle2);
    EXPECT_LE(e.fast_range2, 1.05 * e.slow_range2);
    // Twenty-five ranges of 1 cm noise, averaged.
    EXPECT_LT(std::sqrt(e.fast_range2 / e.windows), 0.0035);
}

TEST_P(PlanesAround, SufferLittleFromBeamsThatStartBesideEachOther) {
    const SensorModel sensor = staggered_sensor(64, 1024, 0.0277F);
    Frame frame(sensor);
    const Eigen::Vector3d normal = GetParam().normal.normalized();
    shoot_at_plane(sensor, normal, GetParam().offset_m, 0.0, frame);
    const Errors e = compare(sensor, normal, GetParam().offset_m, frame, 4);
    EXPECT_LT(std::sqrt(e.fast_angle2 / e.windows), 0.5);
    EXPECT_LT(std::sqrt(e.fast_range2 / e.windows), 0.002);
}

INSTANTIATE_TEST_SUITE_P(PlaneWindows, PlanesAround,
                         testing::Values(Plane{{1, 0, 0}, 4.0}, Plane{{0.2, -1, 0.1}, 6.0}, Plane{{-1, 1, 0}, 9.0},
                                         Plane{{0, 0, -1}, 1.5}, Plane{{0.1, 0.2, 1}, 2.5}));

TEST(PlaneWindows, StepLeavesOutWindowsAndChangesNone) {
    const SensorModel sensor = staggered_sensor(16, 512);
    Frame frame(sensor);
    shoot_at_plane(sensor, Eigen::Vector3d(1, 0.3, 0.1).normalized(), 5.0, 0.01, frame);
    PlaneWindows every(sensor, 1);
    every.load(frame);
    for (const int step : {2, 3, 4, 5, 7}) {
        PlaneWindows some(sensor, step);
        some.load(frame);
        ASSERT_EQ(some.windows(), sensor.width / step);
        PlaneRow all_planes, planes;
        for (int row = 0; row < sensor.height; ++row) {
            every.fit_row(row, all_planes);
            some.fit_row(row, planes);
            for (int k = 0; k < some.windows(); ++k) {
                const auto i = static_cast<std::size_t>(k), j = static_cast<std::size_t>(k * step);
                ASSERT_EQ(planes.inverse_range[i], all_planes.inverse_range[j]) << step << ' ' << row << ' ' << k;
                ASSERT_EQ(planes.slope_azimuth[i], all_planes.slope_azimuth[j]);
                ASSERT_EQ(planes.slope_altitude[i], all_planes.slope_altitude[j]);
                ASSERT_EQ(planes.deviation_m[i], all_planes.deviation_m[j]);
            }
        }
    }
}

TEST(PlaneWindows, AWindowWithAHoleIsNone) {
    const SensorModel sensor = staggered_sensor(16, 512);
    Frame frame(sensor);
    receive_all_columns(frame);
    frame.raw.range_mm.fill(5000);
    frame.raw.range_mm(8, 100) = 0;
    PlaneWindows windows(sensor, 1);
    windows.load(frame);
    PlaneRow planes;
    for (int row = 0; row < sensor.height; ++row) {
        windows.fit_row(row, planes);
        for (int c = 50; c < 150; ++c) {
            const bool has_hole = std::abs(row - 8) <= windows.window_rows() / 2 && std::abs(c - 100) <= kWindowRadius;
            EXPECT_EQ(planes.inverse_range[static_cast<std::size_t>(c)] <= 0.0F, has_hole) << row << ' ' << c;
        }
    }
}

/// Loses packets of 16 columns at random.
void lose_packets(const SensorModel& sensor, double share, Frame& frame) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform;
    frame.header.valid_columns = 0;
    for (int m = 0; m < sensor.width; m += 16) {
        const bool comes = uniform(random) >= share;
        for (int i = m; i < m + 16; ++i) frame.columns.valid[static_cast<std::size_t>(i)] = comes ? 1 : 0;
        frame.header.valid_columns += comes ? 16 : 0;
    }
    for (int r = 0; r < sensor.height; ++r) {
        for (int c = 0; c < sensor.width; ++c) {
            const auto m = static_cast<std::size_t>(sensor.measurement_of(r, c));
            if (!frame.columns.valid[m]) frame.raw.range_mm(r, c) = 0;
        }
    }
}

TEST(PlaneWindows, OfWhichColumnsAreMissingAreFittedToTheRest) {
    const SensorModel sensor = staggered_sensor(64, 1024);
    const Eigen::Vector3d normal = Eigen::Vector3d(1, 0.3, 0.1).normalized();
    constexpr double kOffset_m = 6.0;
    constexpr double kNoise_m = 0.01;
    Frame frame(sensor);
    shoot_at_plane(sensor, normal, kOffset_m, kNoise_m, frame);
    PlaneWindows windows(sensor, 4);
    const auto count_whole = [&](const PlaneRow& planes) {
        return std::count_if(planes.inverse_range.begin(), planes.inverse_range.begin() + windows.windows(),
                             [](float inverse) { return inverse > 0.0F; });
    };
    PlaneRow planes;
    long all = 0;
    windows.load(frame);
    for (int row = 0; row < sensor.height; ++row) {
        windows.fit_row(row, planes);
        all += count_whole(planes);
        EXPECT_TRUE(planes.partial.empty());
    }
    lose_packets(sensor, 0.6, frame);
    windows.load(frame);
    int partial = 0;
    double angle2 = 0.0, range2 = 0.0, deviation2 = 0.0;
    for (int row = 0; row < sensor.height; ++row) {
        windows.fit_row(row, planes);
        for (const PlaneRow::Partial& window : planes.partial) {
            const auto i = static_cast<std::size_t>(window.window);
            const Beam beam = beam_of(sensor, row, window.window * 4);
            const double along = normal.dot(beam.direction);
            if (along < 0.3) continue;
            ASSERT_GT(frame.raw.range_mm(row, window.window * 4), 0U);
            angle2 += std::pow(angle_deg(normal_of(sensor, windows, planes, row, window.window, 4), -normal), 2);
            range2 += std::pow(1.0 / static_cast<double>(planes.inverse_range[i]) - kOffset_m / along, 2);
            deviation2 += std::pow(static_cast<double>(planes.deviation_m[i]), 2);
            ++partial;
        }
    }
    // Of the two fifths of the windows whose centre came more than every third, where next to none is whole.
    ASSERT_GT(partial, 0.4 * static_cast<double>(all) / 3.0);
    // Nine times the variance of a whole window at most: of these the angle is off by some 2 degrees.
    EXPECT_LT(std::sqrt(angle2 / partial), 5.0);
    EXPECT_LT(std::sqrt(range2 / partial), kNoise_m);
    // As measured over 25 pixels of which three are spent on the fit.
    EXPECT_NEAR(std::sqrt(deviation2 / partial), kNoise_m * std::sqrt(22.0 / 25.0), 0.1 * kNoise_m);
}

// Two rows lie on a plane whatever they show, three do not.
TEST(PlaneWindows, OfLessThanThreeRowsOrColumnsAreNone) {
    SensorModel sensor = staggered_sensor(16, 512);
    for (const int rows : {2, 3}) {
        // The beams of the middle rows point elsewhere: they were fired when other packets came.
        for (int r = 0; r < sensor.height; ++r) {
            const bool middle = r >= 7 && r < 7 + rows;
            sensor.pixel_shift[static_cast<std::size_t>(r)] = middle ? 32 : 0;
            sensor.azimuth_offset_rad[static_cast<std::size_t>(r)] =
                static_cast<float>((middle ? 32 : 0) * 2.0 * std::numbers::pi / sensor.width);
        }
        Frame frame(sensor);
        shoot_at_plane(sensor, -Eigen::Vector3d::UnitX(), 5.0, 0.0, frame);
        frame.header.valid_columns = sensor.width - 64;
        for (int m = 0; m < sensor.width; ++m) {
            frame.columns.valid[static_cast<std::size_t>(m)] = m >= 32 && m < 96 ? 0 : 1;
        }
        for (int r = 0; r < sensor.height; ++r) {
            for (int c = 0; c < sensor.width; ++c) {
                const auto m = static_cast<std::size_t>(sensor.measurement_of(r, c));
                if (!frame.columns.valid[m]) frame.raw.range_mm(r, c) = 0;
            }
        }
        PlaneWindows windows(sensor, 1);
        windows.load(frame);
        PlaneRow planes;
        windows.fit_row(8, planes);
        // Columns 32 to 63: the middle rows came, the others did not. Near 64 everything is missing.
        int fitted = 0;
        for (int c = 36; c < 60; ++c) {
            ASSERT_GT(frame.raw.range_mm(8, c), 0U);
            fitted += planes.inverse_range[static_cast<std::size_t>(c)] > 0.0F ? 1 : 0;
        }
        EXPECT_EQ(fitted, rows == 3 ? 24 : 0);
        // The last column before the gap has two neighbours, the first one behind it likewise.
        windows.fit_row(2, planes);
        for (const int c : {31, 96}) EXPECT_GT(planes.inverse_range[static_cast<std::size_t>(c)], 0.0F) << c;
    }
}

// What sent no echo is no part of a surface, whether columns are missing beside it or not.
TEST(PlaneWindows, WithAPixelWithoutReturnAreNoneWhereColumnsAreMissingEither) {
    const SensorModel sensor = staggered_sensor(16, 512);
    Frame frame(sensor);
    receive_all_columns(frame);
    frame.raw.range_mm.fill(5000);
    lose_packets(sensor, 0.3, frame);
    PlaneWindows windows(sensor, 1);
    PlaneRow planes;
    windows.load(frame);
    windows.fit_row(8, planes);
    ASSERT_FALSE(planes.partial.empty());
    const int c = planes.partial[planes.partial.size() / 2].window;
    // The centre's row came there.
    frame.raw.range_mm(8, c + 1) = 0;
    windows.load(frame);
    windows.fit_row(8, planes);
    EXPECT_EQ(planes.inverse_range[static_cast<std::size_t>(c)], 0.0F);
}

TEST(PlaneWindows, NoneLiesAcrossTheSeamBetweenTheLastColumnFiredAndTheFirst) {
    const SensorModel sensor = staggered_sensor(32, 512);
    Frame frame(sensor);
    receive_all_columns(frame);
    frame.raw.range_mm.fill(5000);
    PlaneWindows windows(sensor, 1);
    windows.load(frame);
    PlaneRow planes;
    for (int row = 0; row < sensor.height; ++row) {
        windows.fit_row(row, planes);
        const int first = std::clamp(row - windows.window_rows() / 2, 0, sensor.height - windows.window_rows());
        for (int c = 0; c < sensor.width; ++c) {
            int low = sensor.width, high = 0;
            for (int r = first; r < first + windows.window_rows(); ++r) {
                for (int d = -kWindowRadius; d <= kWindowRadius; ++d) {
                    const int m = sensor.measurement_of(r, (c + d + sensor.width) % sensor.width);
                    low = std::min(low, m);
                    high = std::max(high, m);
                }
            }
            EXPECT_EQ(planes.inverse_range[static_cast<std::size_t>(c)] > 0.0F, high - low < sensor.width / 2)
                << row << ' ' << c;
        }
    }
}

// Five rows, three degrees apart, meet a wall of 2.6 m at 10 m: with such windows next to nothing but the ground was
// flat.
TEST(PlaneWindows, OfFewRowsAWallThatThreeRowsMeetIsAPlane) {
    for (const int height : {32, 64}) {
        const SensorModel sensor = staggered_sensor(height, 512);
        Frame frame(sensor);
        shoot_at_plane(sensor, Eigen::Vector3d::UnitX(), 5.0, 0.0, frame);
        const int low = height / 2, high = low + 2;
        for (int r = 0; r < height; ++r) {
            for (int c = 0; (r < low || r > high) && c < sensor.width; ++c) frame.raw.range_mm(r, c) *= 2;
        }
        PlaneWindows windows(sensor, 1);
        windows.load(frame);
        PlaneRow planes;
        windows.fit_row(low + 1, planes);
        int flat = 0;
        for (std::size_t c = 0; c < 512; ++c) {
            flat += planes.inverse_range[c] > 0.0F && planes.deviation_m[c] < 0.03F ? 1 : 0;
        }
        EXPECT_EQ(windows.window_rows(), height == 32 ? 3 : 5);
        if (height == 32) {
            EXPECT_GT(flat, 100);
        } else {
            EXPECT_EQ(flat, 0);
        }
    }
}

TEST(PlaneWindows, ImagesWithFewerRowsThanAWindowHaveNone) {
    const SensorModel sensor = staggered_sensor(2, 512);
    Frame frame(sensor);
    receive_all_columns(frame);
    frame.raw.range_mm.fill(5000);
    PlaneWindows windows(sensor, 1);
    windows.load(frame);
    PlaneRow planes;
    for (int row = 0; row < sensor.height; ++row) {
        windows.fit_row(row, planes);
        for (const float inverse : planes.inverse_range) EXPECT_EQ(inverse, 0.0F);
    }
}

TEST(PlaneWindows, BeamsAreThoseOfTheSensor) {
    const SensorModel sensor = staggered_sensor(16, 512);
    const PlaneWindows windows(sensor, 1);
    for (int r = 0; r < sensor.height; ++r) {
        for (int c = 0; c < sensor.width; c += 7) {
            const BeamFrame beam = windows.beam(r, sensor.measurement_of(r, c));
            EXPECT_LT((beam.direction.cast<double>() - beam_of(sensor, r, c).direction).norm(), 1e-6);
            // Tangents: a right-handed frame, one along growing columns, one up.
            EXPECT_LT(std::abs(beam.direction.dot(beam.along_row)), 1e-6F);
            EXPECT_LT((beam.up - beam.along_row.cross(beam.direction)).norm(), 1e-6F);
            const Eigen::Vector3d next = beam_of(sensor, r, (c + 1) % sensor.width).direction;
            EXPECT_GT(next.dot(beam.along_row.cast<double>()), 0.0);
            EXPECT_GT(beam.up.z(), 0.0F);
        }
    }
}

}  // namespace
}  // namespace dlod::test
