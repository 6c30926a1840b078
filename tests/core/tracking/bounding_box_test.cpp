#include "core/tracking/bounding_box.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace dlod {
namespace {

constexpr double kPi = std::numbers::pi;

/// Points on a grid inside of a box, in axes of the world about the origin.
LocalPoints points_in(const OrientedBox& box, int n_side) {
    LocalPoints out;
    const double c = std::cos(box.yaw_rad), s = std::sin(box.yaw_rad);
    for (int i = 0; i < n_side; ++i) {
        for (int j = 0; j < n_side; ++j) {
            for (int k = 0; k < n_side; ++k) {
                const Eigen::Vector3d f = Eigen::Vector3d(i, j, k) / (n_side - 1) - Eigen::Vector3d::Constant(0.5);
                const Eigen::Vector3d p = f.cwiseProduct(box.size_m);
                out.x.push_back(static_cast<float>(box.center_m.x() + c * p.x() - s * p.y()));
                out.y.push_back(static_cast<float>(box.center_m.y() + s * p.x() + c * p.y()));
                out.z.push_back(static_cast<float>(box.center_m.z() + p.z()));
            }
        }
    }
    return out;
}

TEST(BoundingBox, FindsABoxOfAnyYaw) {
    for (int degrees = -180; degrees <= 180; degrees += 7) {
        OrientedBox truth;
        truth.center_m = {3.0, -2.0, 0.5};
        truth.size_m = {4.0, 1.8, 1.5};
        truth.yaw_rad = degrees * kPi / 180.0;
        const LocalPoints points = points_in(truth, 5);
        const PointSpan all = points_of(points, 0, points.size());
        const PrincipalAxis axis = principal_axis(all, points.origin_m);
        EXPECT_NEAR(std::remainder(axis.yaw_rad - truth.yaw_rad, kPi), 0.0, 1e-5);
        EXPECT_GT(axis.yaw_rad, -kPi / 2 - 1e-9);
        EXPECT_LE(axis.yaw_rad, kPi / 2 + 1e-9);
        EXPECT_NEAR(axis.elongation, 4.0 / 1.8, 1e-4);
        const OrientedBox box = box_at_yaw(all, points.origin_m, axis.yaw_rad);
        EXPECT_LT((box.center_m - truth.center_m).norm(), 1e-4);
        EXPECT_LT((box.size_m - truth.size_m).norm(), 1e-4);
    }
}

TEST(BoundingBox, OfPixelsFollowsThePose) {
    Image<float> x(2, 4), y(2, 4), z(2, 4);
    std::vector<PixelIndex> pixels;
    for (PixelIndex i = 1; i < 8; ++i) {  // pixel 0 does not belong
        x[i] = static_cast<float>(i);
        y[i] = 0.1F * static_cast<float>(i % 2);
        z[i] = 0.0F;
        pixels.push_back(i);
    }
    x[0] = 100.0F;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::AngleAxisd(kPi / 3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    T.translation() = Eigen::Vector3d(1e6, -1e6, 10.0);  // far from the world's origin nothing gets coarser
    const OrientedBox box = bounding_box(pixels, x, y, z, T);
    EXPECT_NEAR(box.size_m.x(), 6.0, 0.05);
    EXPECT_NEAR(box.size_m.y(), 0.1, 0.05);
    EXPECT_NEAR(std::remainder(box.yaw_rad - kPi / 3, kPi), 0.0, 0.02);
    EXPECT_LT((box.center_m - T * Eigen::Vector3d(4.0, 0.05, 0.0)).norm(), 0.03);
}

TEST(BoundingBox, FewPointsGiveAFiniteBox) {
    for (int n : {1, 2, 3}) {
        LocalPoints points;
        for (int i = 0; i < n; ++i) {
            points.x.push_back(5.0F);
            points.y.push_back(2.0F);
            points.z.push_back(static_cast<float>(i));
        }
        const PointSpan all = points_of(points, 0, points.size());
        const PrincipalAxis axis = principal_axis(all, points.origin_m);
        EXPECT_EQ(axis.yaw_rad, 0.0);
        EXPECT_EQ(axis.elongation, 1.0);
        const OrientedBox box = box_at_yaw(all, points.origin_m, axis.yaw_rad);
        EXPECT_TRUE(box.center_m.allFinite());
        EXPECT_GT(box.size_m.minCoeff(), 0.0);
    }
}

// The sign of a principal axis is arbitrary: it must not turn an object round (a mistake of the paper's
// implementation).
TEST(BoundingBox, YawIsResolvedAgainstAReference) {
    for (double reference = -7.0; reference < 7.0; reference += 0.3) {
        for (double yaw = -kPi; yaw < kPi; yaw += 0.2) {
            const double resolved = resolve_yaw(yaw, reference);
            EXPECT_LE(std::abs(resolved - reference), kPi / 2 + 1e-9);
            EXPECT_NEAR(std::remainder(resolved - yaw, kPi), 0.0, 1e-9);
        }
    }
}

TEST(BoundingBox, AnglesAreWrapped) {
    EXPECT_NEAR(wrap_angle(3.0 * kPi + 0.1), -kPi + 0.1, 1e-12);
    EXPECT_NEAR(wrap_angle(-0.2), -0.2, 1e-12);
}

}  // namespace
}  // namespace dlod
