#include "core/registration/observability.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <functional>
#include <numbers>
#include <random>

namespace dlod {
namespace {

constexpr double kPi = std::numbers::pi;

struct Surface {
    Eigen::Vector3d point, normal;  ///< as seen from the sensor at the origin
};

/// Points of a surface, their normals as uncertain as measured ones.
PlaneMatches matches_of(int count, const std::function<Surface(double u, double v)>& surface, double noise_rad = 0.02) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::normal_distribution<double> gauss;
    PlaneMatches matches;
    matches.reserve(static_cast<std::size_t>(count));
    matches.clear();
    for (int i = 0; i < count; ++i) {
        const Surface s = surface(uniform(random), uniform(random));
        const Eigen::Vector3d off(gauss(random), gauss(random), gauss(random));
        const Eigen::Vector3f n = (s.normal + noise_rad * off).normalized().cast<float>();
        const Eigen::Vector3f p = s.point.cast<float>();
        matches.push(n.data(), p.data(), 0.01F, 1e4F, -0.05F);
    }
    return matches;
}

Observability look(PlaneMatches& matches) {
    NormalEquations equations;
    accumulate(matches, equations);
    return observe(matches, equations);
}

/// Length of what is left of a direction of translation (block 0) or rotation (block 3).
double left_of(const Observability& o, int block, const Eigen::Vector3d& direction) {
    return (o.projector.block<3, 3>(block, block) * direction.normalized()).norm();
}

Surface ground(double u, double v) {
    return {{20.0 * u, 20.0 * v, -1.5}, {0, 0, 1}};
}

/// A straight passage along x: floor, ceiling and two walls.
Surface passage(double u, double v) {
    const double along = 25.0 * u;
    if (v < -0.5) return {{along, 4.0 * v + 3.0, -1.2}, {0, 0, 1}};
    if (v < 0.0) return {{along, 4.0 * v + 1.0, 1.3}, {0, 0, -1}};
    if (v < 0.5) return {{along, -1.4, 4.0 * v - 1.0}, {0, 1, 0}};
    return {{along, 1.5, 4.0 * v - 3.0}, {0, -1, 0}};
}

TEST(Observability, AnOpenPlaneFixesHeightAndLevelOnly) {
    auto matches = matches_of(2000, ground);
    const Observability o = look(matches);
    EXPECT_EQ(o.unobservable, 3);
    EXPECT_LT(left_of(o, 0, Eigen::Vector3d::UnitX()), 0.05);
    EXPECT_LT(left_of(o, 0, Eigen::Vector3d::UnitY()), 0.05);
    EXPECT_GT(left_of(o, 0, Eigen::Vector3d::UnitZ()), 0.99);
    EXPECT_GT(left_of(o, 3, Eigen::Vector3d::UnitX()), 0.99);
    EXPECT_GT(left_of(o, 3, Eigen::Vector3d::UnitY()), 0.99);
    EXPECT_LT(left_of(o, 3, Eigen::Vector3d::UnitZ()), 0.05);
}

TEST(Observability, ASquareTubeHidesTheWayAlongIt) {
    auto matches = matches_of(2000, passage);
    const Observability o = look(matches);
    EXPECT_EQ(o.unobservable, 1);
    EXPECT_LT(left_of(o, 0, Eigen::Vector3d::UnitX()), 0.05);
    for (const int axis : {1, 2}) EXPECT_GT(left_of(o, 0, Eigen::Vector3d::Unit(axis)), 0.99);
    for (const int axis : {0, 1, 2}) EXPECT_GT(left_of(o, 3, Eigen::Vector3d::Unit(axis)), 0.99);
}

TEST(Observability, ARoundTubeHidesTheTurnAboutItToo) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    auto matches = matches_of(2000, [&](double u, double v) {
        const Eigen::Vector3d n(0.0, -std::cos(kPi * v), -std::sin(kPi * v));
        return Surface{R * Eigen::Vector3d(20.0 * u, -2.0 * n.y(), -2.0 * n.z()), R * n};
    });
    const Observability o = look(matches);
    EXPECT_EQ(o.unobservable, 2);
    EXPECT_LT(left_of(o, 0, R.col(0)), 0.05);
    EXPECT_LT(left_of(o, 3, R.col(0)), 0.05);
    for (const int axis : {1, 2}) {
        EXPECT_GT(left_of(o, 0, R.col(axis)), 0.99);
        EXPECT_GT(left_of(o, 3, R.col(axis)), 0.99);
    }
}

TEST(Observability, ARoomHidesNothing) {
    auto matches = matches_of(1000, [](double u, double v) {
        if (u < -0.8) return Surface{{6.0, 4.0 * v, 0.0}, {-1, 0, 0}};
        return passage(u / 4.0, v);
    });
    const Observability o = look(matches);
    EXPECT_EQ(o.unobservable, 0);
    EXPECT_EQ(o.projector, Matrix6d::Identity());
}

TEST(Observability, AFewDozenPointsOfAnEndWallAreEvidence) {
    int wall = 0;
    auto matches = matches_of(3000, [&](double u, double v) {
        if (wall < 30) {
            ++wall;
            return Surface{{15.0, 1.4 * u, 1.2 * v}, {-1, 0, 0}};
        }
        return passage(u, v);
    });
    EXPECT_EQ(look(matches).unobservable, 0);
}

TEST(Observability, ProjectionTakesOutWhatTheMatchesSeemToSay) {
    auto matches = matches_of(2000, passage);
    NormalEquations equations;
    accumulate(matches, equations);
    const NormalEquations before = equations;
    const Observability o = observe(matches, equations);
    ASSERT_EQ(o.unobservable, 1);
    project(o, equations);
    // The hidden direction is the one that the projector takes to nothing.
    const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(o.projector);
    const Vector6d hidden = solver.eigenvectors().col(0);
    ASSERT_NEAR(solver.eigenvalues()[0], 0.0, 1e-9);
    for (const Matrix6d& A : equations.A) EXPECT_LT((A * hidden).norm(), 1e-6 * before.A[0].norm());
    for (const Vector6d& b : equations.b) EXPECT_LT(std::abs(b.dot(hidden)), 1e-6 * before.b[0].norm());
    // The others are as before.
    const Vector6d across = o.projector * Vector6d::Unit(1);
    EXPECT_NEAR(across.dot(equations.A[0] * across), across.dot(before.A[0] * across), 1e-9 * before.A[0].norm());
}

TEST(Observability, NothingObservableIsTouchedByProjection) {
    auto matches = matches_of(500, [](double u, double v) {
        const Eigen::Vector3d n(std::cos(9.0 * u), std::sin(9.0 * u) * std::cos(7.0 * v), std::sin(7.0 * v));
        return Surface{-5.0 * n + Eigen::Vector3d(u, v, u * v), n.normalized()};
    });
    NormalEquations equations;
    accumulate(matches, equations);
    const NormalEquations before = equations;
    project(observe(matches, equations), equations);
    EXPECT_EQ(equations.A, before.A);
    EXPECT_EQ(equations.b, before.b);
}

TEST(Observability, NoMatchesDetermineNothing) {
    PlaneMatches matches;
    const Observability o = look(matches);
    EXPECT_EQ(o.unobservable, 6);
    EXPECT_TRUE(o.projector.allFinite());
    EXPECT_LT(o.projector.norm(), 1e-9);
}

}  // namespace
}  // namespace dlod
