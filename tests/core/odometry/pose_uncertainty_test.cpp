#include "core/odometry/pose_uncertainty.hpp"

#include <gtest/gtest.h>

namespace dlod::test {
namespace {

using Directions = PoseUncertainty::Directions;

/// Walls all around, 100 matches each, weighing 1 / (1 cm)^2.
PlaneMatches walls() {
    PlaneMatches matches;
    matches.reserve(600);
    for (int i = 0; i < 600; ++i) {
        const int axis = i / 2 % 3;
        float normal[3] = {}, lever[3] = {};
        normal[axis] = i % 2 == 0 ? 1.0F : -1.0F;
        lever[axis] = 3.0F;
        lever[(axis + 1) % 3] = static_cast<float>(i % 7) - 3.0F;
        lever[(axis + 2) % 3] = static_cast<float>(i % 5) - 2.0F;
        matches.push(normal, lever, 0.0F, 1e4F, 0.0F, static_cast<std::uint32_t>(i % 6), 0);
    }
    return matches;
}

TEST(PoseUncertainty, ComesOfTheMatchesAndOfTheSurfacesThatTheyShare) {
    PlaneMatches matches = walls();
    NormalEquations equations;
    accumulate(matches, equations);
    PoseUncertainty uncertainty(0.002);
    uncertainty.see_matches(matches, equations, Directions(6, 0));
    // 200 matches face each axis; without levers in the way that is 1 cm / sqrt(200).
    EXPECT_NEAR(std::sqrt(uncertainty.from_scan()(0, 0)), 0.01 / std::sqrt(200.0), 1e-4);
    const Matrix6d nothing = Matrix6d::Zero();
    const Matrix6d near = uncertainty.of_registered(0.0, nothing, Directions(6, 0));
    const Matrix6d far = uncertainty.of_registered(1.0, nothing, Directions(6, 0));
    EXPECT_GT(far(0, 0), near(0, 0));
    // The two walls of an axis are off by 2 mm each, beside their points' noise.
    EXPECT_NEAR(std::sqrt(far(0, 0) - near(0, 0)), std::sqrt(0.5 * (4e-6 + 1e-6)), 2e-4);
}

TEST(PoseUncertainty, WhatIsHeldIsAsUncertainAsThePrediction) {
    PlaneMatches matches = walls();
    NormalEquations equations;
    accumulate(matches, equations);
    Directions held = Directions::Zero(6, 1);
    held(0, 0) = 1.0;
    PoseUncertainty uncertainty(0.002);
    uncertainty.see_matches(matches, equations, held);
    EXPECT_NEAR(uncertainty.from_scan()(0, 0), 0.0, 1e-12);
    const Matrix6d predicted = 0.25 * Matrix6d::Identity();
    const Matrix6d covariance = uncertainty.of_registered(0.0, predicted, held);
    EXPECT_NEAR(covariance(0, 0), 0.25, 1e-9);
    EXPECT_LT(covariance(1, 1), 1e-5);
}

TEST(PoseUncertainty, WithoutImuItHasWhatTheFilterDoesNotFollow) {
    PlaneMatches matches = walls();
    for (std::size_t i = 0; i < matches.count; ++i) matches.residual[i] = -0.05F * matches.h[0][i];
    NormalEquations equations;
    accumulate(matches, equations);
    PoseUncertainty uncertainty(0.002);
    uncertainty.see_matches(matches, equations, Directions(6, 0));
    uncertainty.see_lag(equations, Vector6d::Zero(), Matrix6d::Zero(), Directions(6, 0));
    const double at_once = uncertainty.from_scan()(0, 0);
    EXPECT_NEAR(std::sqrt(at_once), 0.05, 0.005);
    // It remembers for some scans, and the IMU makes it forget.
    for (auto& residual : matches.residual) residual = 0.0F;
    accumulate(matches, equations);
    uncertainty.see_matches(matches, equations, Directions(6, 0));
    uncertainty.see_lag(equations, Vector6d::Zero(), Matrix6d::Zero(), Directions(6, 0));
    const double later = uncertainty.from_scan()(0, 0);
    EXPECT_LT(later, at_once);
    EXPECT_GT(std::sqrt(later), 0.01);
    uncertainty.see_no_lag();
    uncertainty.see_matches(matches, equations, Directions(6, 0));
    EXPECT_LT(std::sqrt(uncertainty.from_scan()(0, 0)), 0.001);
}

TEST(PoseUncertainty, AMapThatBeganUncertainTurnedMovesWhatIsFarFromItsStart) {
    PoseUncertainty uncertainty(0.002);
    Matrix6d start = Matrix6d::Zero();
    start(5, 5) = 0.01 * 0.01;
    uncertainty.begin_map({1.0, 0.0, 0.0}, start);
    const KeyframeDatabase empty(KeyframeConfig{}, VoxelMapConfig{});
    uncertainty.see_map(empty, {11.0, 0.0, 0.0}, Directions(6, 0));
    EXPECT_NEAR(std::sqrt(uncertainty.anchor()(1, 1)), 0.1, 1e-9);
    EXPECT_NEAR(uncertainty.anchor()(0, 0), 0.0, 1e-12);
    const Matrix6d predicted = 4e-4 * Matrix6d::Identity();
    EXPECT_NEAR(uncertainty.of_predicted(predicted)(1, 1), 0.01 + 4e-4, 1e-9);
}

}  // namespace
}  // namespace dlod::test
