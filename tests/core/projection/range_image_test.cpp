#include "core/projection/range_image.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace dlod {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TEST(UniformProjection, FollowsEquationOne) {
    const UniformProjection projection(64, 1024, 16.0 * kDegree, -16.0 * kDegree);
    // Half a degree a row; column 0 starts at azimuth atan2(x, y) = 0, the y axis.
    EXPECT_EQ(projection.project({0.0F, 10.0F, 0.0F}), (Pixel{32, 0}));
    EXPECT_EQ(projection.project({10.0F, 0.001F, 0.0F}), (Pixel{32, 255}));
    EXPECT_EQ(projection.project({-10.0F, 0.0F, 0.0F}), (Pixel{32, 768}));
    EXPECT_EQ(projection.project({0.0F, 10.0F, static_cast<float>(10.0 * std::tan(15.9 * kDegree))}), (Pixel{0, 0}));
    EXPECT_FALSE(projection.project({0.0F, 10.0F, 10.0F}).has_value());
    EXPECT_FALSE(projection.project({0.0F, 10.0F, -10.0F}).has_value());
    EXPECT_FALSE(projection.project({0.0F, 0.0F, 0.0F}).has_value());
}

TEST(UniformProjection, NearestPointOfAPixelCounts) {
    const UniformProjection projection(16, 64, 0.3, -0.3);
    Image<float> range;
    const Eigen::Vector3f cloud[] = {{0.1F, 6.0F, 0.1F}, {0.05F, 3.0F, 0.05F}, {0.1F, 8.0F, 0.1F}};
    projection.render(cloud, range);
    const auto pixel = projection.project(cloud[0]);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_FLOAT_EQ(range(pixel->row, pixel->column), range_of(cloud[1]));
    int filled = 0;
    for (std::size_t i = 0; i < range.size(); ++i) filled += range[i] > 0.0F ? 1 : 0;
    EXPECT_EQ(filled, 1);
}

TEST(StructuredProjection, FollowsEquationThree) {
    EXPECT_EQ(pixel_of(0, 1024), (Pixel{0, 0}));
    EXPECT_EQ(pixel_of(3 * 1024 + 17, 1024), (Pixel{3, 17}));
}

struct Layout {
    int height, width;
    double top_deg, bottom_deg, beam_origin_m;
    std::vector<double> azimuth_deg;  // repeats over the rows
    bool uneven;
};

SensorModel make_sensor(const Layout& layout) {
    SensorModel sensor;
    sensor.height = layout.height;
    sensor.width = layout.width;
    sensor.column_window_last = layout.width - 1;
    sensor.beam_origin_m = static_cast<float>(layout.beam_origin_m);
    for (int r = 0; r < layout.height; ++r) {
        double altitude = layout.top_deg + (layout.bottom_deg - layout.top_deg) * r / (layout.height - 1);
        if (layout.uneven) altitude += 0.2 * (layout.top_deg - layout.bottom_deg) / layout.height * std::sin(0.7 * r);
        const double azimuth = layout.azimuth_deg[static_cast<std::size_t>(r) % layout.azimuth_deg.size()];
        sensor.altitude_rad.push_back(static_cast<float>(altitude * kDegree));
        sensor.azimuth_offset_rad.push_back(static_cast<float>(azimuth * kDegree));
        // Destaggering: rows that look to the same side come to lie under each other.
        sensor.pixel_shift.push_back(static_cast<int>(std::lround((azimuth + 12.0) / 360.0 * layout.width)));
    }
    sensor.T_sensor_lidar.linear() = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    sensor.T_sensor_lidar.translation().z() = 0.03618;
    return sensor;
}

class RoundTrip : public testing::TestWithParam<Layout> {};

/// Every pixel, shot at several ranges with Ouster's formulas, comes back to itself.
TEST_P(RoundTrip, EveryPixelComesBack) {
    const SensorModel sensor = make_sensor(GetParam());
    const SensorProjection projection(sensor);
    AlignedVector<float> x, y, z;
    std::vector<int> expected;
    std::vector<double> expected_range;
    for (const double range : {0.8, 3.0, 60.0}) {
        for (int r = 0; r < sensor.height; ++r) {
            for (int m = 0; m < sensor.width; m += 7) {
                const double theta = 2.0 * std::numbers::pi * (1.0 - m / static_cast<double>(sensor.width));
                const double a = -static_cast<double>(sensor.azimuth_offset_rad[static_cast<std::size_t>(r)]);
                const double phi = static_cast<double>(sensor.altitude_rad[static_cast<std::size_t>(r)]);
                const double n = static_cast<double>(sensor.beam_origin_m);
                const Eigen::Vector3d lidar((range - n) * std::cos(theta + a) * std::cos(phi) + n * std::cos(theta),
                                            (range - n) * std::sin(theta + a) * std::cos(phi) + n * std::sin(theta),
                                            (range - n) * std::sin(phi));
                const Eigen::Vector3d p = sensor.T_sensor_lidar * lidar;
                x.push_back(static_cast<float>(p.x()));
                y.push_back(static_cast<float>(p.y()));
                z.push_back(static_cast<float>(p.z()));
                const int column = (m + sensor.pixel_shift[static_cast<std::size_t>(r)]) % sensor.width;
                expected.push_back(r * sensor.width + column);
                expected_range.push_back(p.norm());
            }
        }
    }
    std::vector<std::int32_t> pixel(expected.size());
    std::vector<float> found_range(expected.size());
    // The points are given in another frame: the transform is part of the round trip.
    const Eigen::Isometry3f T = (Eigen::Translation3f(0.5F, -1.0F, 0.2F) *
                                 Eigen::AngleAxisf(0.4F, Eigen::Vector3f(1.0F, 2.0F, 3.0F).normalized())) *
                                Eigen::Isometry3f::Identity();
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Eigen::Vector3f p = T.inverse() * Eigen::Vector3f(x[i], y[i], z[i]);
        x[i] = p.x(), y[i] = p.y(), z[i] = p.z();
    }
    projection.project(T, static_cast<int>(x.size()), x.data(), y.data(), z.data(), nullptr, pixel.data(),
                       found_range.data());
    int wrong = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        wrong += pixel[i] != expected[i] ? 1 : 0;
        ASSERT_NEAR(found_range[i], expected_range[i], 1e-4 * expected_range[i] + 1e-4);
    }
    EXPECT_EQ(wrong, 0) << "of " << expected.size();
}

INSTANTIATE_TEST_SUITE_P(Sensors, RoundTrip,
                         testing::Values(Layout{128, 1024, 45.75, -46.26, 0.02767, {11.24, 3.93, -3.29, -10.34}, true},
                                         Layout{64, 1024, 16.6, -16.6, 0.01581, {3.1, 0.9, -0.9, -3.1}, true},
                                         Layout{32, 2048, 22.5, -22.5, 0.0, {0.0}, false},
                                         Layout{128, 512, 11.25, -11.25, 0.01376, {4.2, 1.4, -1.4, -4.2}, true},
                                         Layout{16, 4096, 10.0, -35.0, 0.02, {0.5, -0.5}, false}));

TEST(SensorProjection, OutsideTheBeamsIsOutside) {
    const SensorModel sensor = make_sensor({64, 1024, 20.0, -20.0, 0.0, {0.0}, false});
    const SensorProjection projection(sensor);
    EXPECT_FALSE(projection.project({1.0F, 0.0F, 5.0F}).has_value());
    EXPECT_FALSE(projection.project({1.0F, 0.0F, -5.0F}).has_value());
    EXPECT_FALSE(projection.project({0.0F, 0.0F, 1.0F}).has_value());
    EXPECT_TRUE(projection.project({5.0F, 0.0F, 0.0F}).has_value());
}

}  // namespace
}  // namespace dlod
