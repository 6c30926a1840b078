#include "core/tracking/rectangle_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace dlod {
namespace {

/// Points on two sides of a car, the longer one along `yaw`, as a sensor sees them.
LocalPoints two_sides(double yaw_rad) {
    LocalPoints p;
    const auto add = [&](double u, double v) {
        p.x.push_back(static_cast<float>(10.0 + std::cos(yaw_rad) * u - std::sin(yaw_rad) * v));
        p.y.push_back(static_cast<float>(3.0 + std::sin(yaw_rad) * u + std::cos(yaw_rad) * v));
        p.z.push_back(0.0F);
    };
    for (int i = 0; i <= 44; ++i) add(0.1 * i, 0.0);
    for (int i = 0; i <= 18; ++i) add(0.0, 0.1 * i);
    return p;
}

TEST(RectangleFit, FindsTheSidesWherePrincipalAxesGiveTheDiagonal) {
    for (const double yaw : {0.0, 0.2, 0.7, 1.1, 1.5}) {
        const LocalPoints p = two_sides(yaw);
        const PointSpan all = points_of(p, 0, p.size());
        const auto sides = rectangle_yaw(all);
        ASSERT_TRUE(sides.has_value()) << yaw;
        EXPECT_NEAR(std::remainder(*sides - yaw, 0.5 * std::numbers::pi), 0.0, 0.03) << yaw;
        EXPECT_GT(std::abs(std::remainder(principal_axis(all, p.origin_m).yaw_rad - yaw, std::numbers::pi)), 0.1);
    }
}

TEST(RectangleFit, ADiscAndAHandfulOfPointsHaveNoSides) {
    LocalPoints disc;
    for (int i = 0; i < 400; ++i) {
        const double r = std::sqrt(i / 400.0), a = 2.4 * i;
        disc.x.push_back(static_cast<float>(r * std::cos(a)));
        disc.y.push_back(static_cast<float>(r * std::sin(a)));
        disc.z.push_back(0.0F);
    }
    EXPECT_FALSE(rectangle_yaw(points_of(disc, 0, disc.size())).has_value());
    EXPECT_FALSE(rectangle_yaw(points_of(disc, 0, 5)).has_value());
}

}  // namespace
}  // namespace dlod
