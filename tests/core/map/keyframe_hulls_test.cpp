#include "core/map/keyframe_hulls.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

/// An L of 5 x 5 cells of 2 m, with all its inner points.
std::vector<Eigen::Vector3d> l_shape() {
    std::vector<Eigen::Vector3d> positions;
    for (int x = 0; x < 6; ++x) {
        for (int y = 0; y < 6; ++y) {
            // A little off the grid: no three on a line, no four on a circle.
            if (x < 3 || y < 3) positions.push_back({2.0 * x + 0.01 * y * y, 2.0 * y + 0.013 * x * x, 0.1 * x});
        }
    }
    return positions;
}

bool contains(const std::vector<std::size_t>& indices, const std::vector<Eigen::Vector3d>& positions, double x,
              double y) {
    return std::any_of(indices.begin(), indices.end(),
                       [&](std::size_t i) { return (positions[i].head<2>() - Eigen::Vector2d(x, y)).norm() < 0.6; });
}

TEST(KeyframeHulls, ConvexHullIsTheSmallestConvexSetAroundAllPositions) {
    const auto positions = l_shape();
    const auto hull = convex_hull(positions);
    ASSERT_GE(hull.size(), 5U);
    // Known answer by brute force: a position is on the hull when some line through it has all others on one side.
    for (std::size_t i = 0; i < positions.size(); ++i) {
        bool extreme = false;
        for (int k = 0; k < 3600 && !extreme; ++k) {
            const Eigen::Vector2d d(std::cos(k * 1.745329e-3), std::sin(k * 1.745329e-3));
            extreme = std::all_of(positions.begin(), positions.end(), [&](const auto& p) {
                return d.dot(p.template head<2>() - positions[i].head<2>()) <= 1e-9;
            });
        }
        EXPECT_EQ(std::count(hull.begin(), hull.end(), i), extreme ? 1 : 0) << i;
    }
}

TEST(KeyframeHulls, ConcaveHullFollowsTheInnerCorner) {
    const auto positions = l_shape();
    const auto hull = concave_hull(positions, 1.6);
    // It cuts the inner corner by the diagonal of one cell, whose circle has a radius of 1.41 m.
    EXPECT_TRUE(contains(hull, positions, 4.0, 6.0));
    EXPECT_TRUE(contains(hull, positions, 6.0, 4.0));
    EXPECT_FALSE(contains(hull, positions, 2.0, 2.0));
    EXPECT_FALSE(contains(convex_hull(positions), positions, 4.0, 6.0));
}

TEST(KeyframeHulls, PositionsOnALineOrTooFewHaveNone) {
    std::vector<Eigen::Vector3d> line;
    for (int i = 0; i < 10; ++i) line.push_back({1.0 * i, 0.5 * i, 0.0});
    EXPECT_TRUE(convex_hull(line).empty());
    EXPECT_TRUE(concave_hull(line, 2.0).empty());
    EXPECT_TRUE(convex_hull(std::span(line).first(3)).empty());
}

}  // namespace
}  // namespace dlod
