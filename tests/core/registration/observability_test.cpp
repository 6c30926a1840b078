#include "core/registration/observability.hpp"

#include <gtest/gtest.h>

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
        matches.push(n.data(), p.data(), 0.01F, 1e4F, -0.05F, static_cast<std::uint32_t>(i), 0);
    }
    return matches;
}

Observability look(PlaneMatches& matches) {
    NormalEquations equations;
    accumulate(matches, equations);
    return Observability::of(matches, equations);
}

/// Length of what is left of a direction of translation (block 0) or rotation (block 3).
double left_of(const Observability& o, int block, const Eigen::Vector3d& direction) {
    Vector6d u = Vector6d::Zero();
    u.segment<3>(block) = direction.normalized();
    const Observability::Directions held = o.directions();
    return (u - held * (held.transpose() * u)).norm();
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

/// 3000 points of a passage, of which the first thirty lie on a wall at its end.
PlaneMatches matches_of_passage_with_end_wall() {
    int wall = 0;
    return matches_of(3000, [&](double u, double v) {
        if (wall < 30) {
            ++wall;
            return Surface{{15.0, 1.4 * u, 1.2 * v}, {-1, 0, 0}};
        }
        return passage(u, v);
    });
}

TEST(Observability, AnOpenPlaneFixesHeightAndLevelOnly) {
    auto matches = matches_of(2000, ground);
    const Observability o = look(matches);
    EXPECT_EQ(o.unobservable(), 3);
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
    EXPECT_EQ(o.unobservable(), 1);
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
    EXPECT_EQ(o.unobservable(), 2);
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
    EXPECT_EQ(o.unobservable(), 0);
}

TEST(Observability, AFewDozenPointsOfAnEndWallAreEvidence) {
    auto matches = matches_of_passage_with_end_wall();
    EXPECT_EQ(look(matches).unobservable(), 0);
}

// A voxel at an edge of a tunnel has one plane, tilted at random; what matches it lies off it by more or less.
TEST(Observability, MatchesThatDisagreeOnTheirSurfaceAreNoEvidence) {
    auto matches = matches_of_passage_with_end_wall();
    for (std::uint32_t i = 0; i < 30; ++i) {
        matches.surface[i] = i % 4;
        matches.residual[i] = 0.2F;
    }
    EXPECT_EQ(look(matches).unobservable(), 0) << "all are as far off as the pose is";
    for (std::uint32_t i = 0; i < 30; ++i) matches.residual[i] = i % 8 < 4 ? -0.08F : 0.08F;
    EXPECT_EQ(look(matches).unobservable(), 1);
}

TEST(Observability, AFewFacingMatchesAreHeardWithoutTheNoiseOfTheOthers) {
    auto matches = matches_of_passage_with_end_wall();
    const Observability o = look(matches);
    ASSERT_EQ(o.unobservable(), 0);
    NormalEquations before;
    accumulate(matches, before);
    o.leave_facing(matches);
    NormalEquations after;
    accumulate(matches, after);
    EXPECT_GT(before.A[0](0, 0), 1.02 * 30.0 * 1e4);
    EXPECT_NEAR(after.A[0](0, 0), 30.0 * 1e4, 0.01 * 30.0 * 1e4);
    for (const int axis : {1, 2}) EXPECT_NEAR(after.A[0](axis, axis) / before.A[0](axis, axis), 1.0, 0.01);
}

TEST(Observability, MoreCanBeDemandedOfTheFewMatchesThatFaceADirection) {
    auto matches = matches_of_passage_with_end_wall();
    NormalEquations equations;
    accumulate(matches, equations);
    EXPECT_EQ(Observability::of(matches, equations, 5.0).unobservable(), 0);
    EXPECT_EQ(Observability::of(matches, equations, 7.0).unobservable(), 1);
}

TEST(Observability, NoMatchesDetermineNothing) {
    PlaneMatches matches;
    const Observability o = look(matches);
    EXPECT_EQ(o.unobservable(), 6);
    const Observability::Directions held = o.directions();
    EXPECT_LT((held.transpose() * held - Matrix6d::Identity()).norm(), 1e-9);
}

TEST(Observability, WhereFewSpeakThePredictionHasASay) {
    auto matches = matches_of_passage_with_end_wall();
    // Ten of the thirty lie on a door that has swung by 6 cm; the prediction was right to within 5 mm.
    for (std::size_t i = 0; i < 30; ++i) matches.residual[i] = i < 10 ? 0.06F : 0.004F;
    const Observability o = look(matches);
    ASSERT_TRUE(o.any_weak());
    const AlignedVector<float> before = matches.weight;
    const Matrix6d prior = 0.005 * 0.005 * Matrix6d::Identity();
    o.ask_prediction(matches, Vector6d::Zero(), prior);
    for (std::size_t i = 0; i < 30; ++i) {
        if (i < 10) {
            EXPECT_LT(matches.weight[i], 0.1F * before[i]) << i;
        } else {
            EXPECT_GT(matches.weight[i], 0.8F * before[i]) << i;
        }
    }
    // What counts is the distance from the prediction, wherever the solution is by now.
    auto moved = matches_of_passage_with_end_wall();
    for (std::size_t i = 0; i < 30; ++i) moved.residual[i] = 0.004F + 0.06F * moved.h[0][i];
    Vector6d change = Vector6d::Zero();
    change[0] = 0.06;
    o.ask_prediction(moved, change, prior);
    for (std::size_t i = 0; i < 30; ++i) EXPECT_GT(moved.weight[i], 0.8F * before[i]) << i;
}

}  // namespace
}  // namespace dlod
