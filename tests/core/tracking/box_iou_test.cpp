#include "core/tracking/box_iou.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace dlod {
namespace {

OrientedBox box(double x, double y, double z, double yaw, double l, double w, double h) {
    OrientedBox b;
    b.center_m = {x, y, z};
    b.yaw_rad = yaw;
    b.size_m = {l, w, h};
    return b;
}

/// Share of points thrown into a cube around both boxes.
double monte_carlo_iou(const OrientedBox& a, const OrientedBox& b, std::mt19937& random, int samples) {
    const double reach = (a.center_m - b.center_m).norm() + a.size_m.norm() + b.size_m.norm();
    std::uniform_real_distribution<double> u(-0.5 * reach, 0.5 * reach);
    int both = 0, either = 0;
    for (int i = 0; i < samples; ++i) {
        const Eigen::Vector3d p = 0.5 * (a.center_m + b.center_m) + Eigen::Vector3d(u(random), u(random), u(random));
        const bool in_a = a.contains(p), in_b = b.contains(p);
        both += in_a && in_b;
        either += in_a || in_b;
    }
    return either > 0 ? static_cast<double>(both) / either : 0.0;
}

TEST(BoxIou, KnownAnswers) {
    const OrientedBox a = box(0, 0, 0, 0, 2, 2, 2);
    EXPECT_NEAR(box_iou(a, a), 1.0, 1e-12);
    EXPECT_NEAR(box_iou(a, box(1, 0, 0, 0, 2, 2, 2)), 1.0 / 3.0, 1e-12);
    EXPECT_NEAR(box_iou(a, box(0, 0, 1, 0, 2, 2, 2)), 1.0 / 3.0, 1e-12);
    EXPECT_EQ(box_iou(a, box(0, 0, 2.5, 0, 2, 2, 2)), 0.0);
    EXPECT_EQ(box_iou(a, box(5, 0, 0, 0.3, 2, 2, 2)), 0.0);
    EXPECT_NEAR(footprint_iou(a, box(0, 0, 9, 0, 2, 1, 2)), 0.5, 1e-12);
    // A square within a square turned by 45 degrees: an octagon of area 8 (sqrt(2) - 1).
    const double octagon = 8.0 * (std::sqrt(2.0) - 1.0);
    EXPECT_NEAR(footprint_intersection_m2(a, box(0, 0, 0, std::numbers::pi / 4, 2, 2, 2)), octagon, 1e-9);
    // The reference took sin(yaw / 2) for the angle: at 90 degrees that is 40.5 degrees, and this is no longer exact.
    EXPECT_NEAR(footprint_intersection_m2(box(0, 0, 0, std::numbers::pi / 2, 4, 1, 1), box(0, 0, 0, 0, 4, 1, 1)), 1.0,
                1e-12);
}

TEST(BoxIou, AgreesWithMonteCarlo) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> offset(-0.8, 0.8), angle(-4.0, 4.0), side(0.4, 3.0);
    for (int i = 0; i < 40; ++i) {
        const OrientedBox a = box(10, 20, 1, angle(random), side(random), side(random), side(random));
        const OrientedBox b = box(10 + offset(random), 20 + offset(random), 1 + offset(random), angle(random),
                                  side(random), side(random), side(random));
        EXPECT_NEAR(box_iou(a, b), monte_carlo_iou(a, b, random, 40000), 0.03);
        EXPECT_NEAR(box_iou(a, b), box_iou(b, a), 1e-9);
    }
}

TEST(BoxIou, TouchingAndFlatBoxes) {
    EXPECT_EQ(box_iou(box(0, 0, 0, 0, 1, 1, 1), box(1, 0, 0, 0, 1, 1, 1)), 0.0);
    EXPECT_EQ(box_iou(box(0, 0, 0, 0, 0, 0, 0), box(0, 0, 0, 0, 0, 0, 0)), 0.0);
}

TEST(BoxIou, DistanceToTheFootprint) {
    const OrientedBox b = box(1, 1, 0, std::numbers::pi / 2, 4, 2, 1);  // 2 along x, 4 along y
    EXPECT_EQ(footprint_distance_m(b, {1.5, 2.5, 9}), 0.0);
    EXPECT_NEAR(footprint_distance_m(b, {4, 1, 0}), 2.0, 1e-9);
    EXPECT_NEAR(footprint_distance_m(b, {5, 7, 0}), 5.0, 1e-9);
}

}  // namespace
}  // namespace dlod
