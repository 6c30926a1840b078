#include "core/evidence/plan_line.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace dlod {
namespace {

constexpr double kNoise_m = 0.01;

/// Points along a line from (1, 2) at an angle, evenly over 2 m.
std::vector<Eigen::Vector2d> line_points(double angle_rad, int count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> gauss;
    const Eigen::Vector2d along(std::cos(angle_rad), std::sin(angle_rad));
    std::vector<Eigen::Vector2d> points;
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector2d across(-along.y(), along.x());
        points.push_back(Eigen::Vector2d(1.0, 2.0) + (2.0 * i / (count - 1)) * along +
                         kNoise_m * gauss(random) * across);
    }
    return points;
}

TEST(PlanLine, FitsPointsAndPointsTheWayItStarted) {
    const auto points = line_points(0.5, 200, 1);
    PlanLine start;
    start.along = -Eigen::Vector2d::UnitX();
    const PlanLine line = fit_line(start, [&](auto add) {
        for (const Eigen::Vector2d& p : points) add(p);
    });
    EXPECT_EQ(line.points, 200);
    const double angle_sd_rad = kNoise_m / (line.spread_m * std::sqrt(200.0));
    EXPECT_NEAR(line.along.x(), -std::cos(0.5), 4.0 * angle_sd_rad);
    EXPECT_NEAR(line.along.y(), -std::sin(0.5), 4.0 * angle_sd_rad);
    EXPECT_NEAR(line.noise_m, kNoise_m, 0.2 * kNoise_m);
    EXPECT_NEAR(line.spread_m, 2.0 / std::sqrt(12.0), 0.01);
    EXPECT_NEAR(line.across({1.0, 2.0}), 0.0, 0.005);
    EXPECT_NEAR(line.at({1.0, 2.0}), 1.0, 0.01);  // from the middle, against the way it points
}

TEST(PlanLine, FewerThanThreePointsLeaveItAsItWas) {
    PlanLine start;
    start.middle = {3.0, 4.0};
    const PlanLine line = fit_line(start, [](auto add) {
        add(Eigen::Vector2d(0.0, 0.0));
        add(Eigen::Vector2d(0.0, 1.0));
    });
    EXPECT_EQ(line.points, 2);
    EXPECT_EQ(line.middle, start.middle);
    EXPECT_EQ(line.along, start.along);
}

TEST(PlanLine, TheMostCommonLineIsNotPulledByTheRest) {
    auto points = line_points(0.3, 60, 2);
    const auto others = line_points(-0.8, 30, 3);
    points.insert(points.end(), others.begin(), others.end());
    const PlanLine line = most_common_line(points, PlanLine{}, 2.0, 0.03);
    EXPECT_NEAR(std::atan2(line.along.y(), line.along.x()), 0.3, 0.01);
    EXPECT_GE(line.points, 60);
    EXPECT_LT(line.points, 66);  // and what of the others crosses it
}

}  // namespace
}  // namespace dlod
