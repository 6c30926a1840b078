#include "core/registration/normal_equations.hpp"

#include <gtest/gtest.h>

#include <random>

namespace dlod {
namespace {

using Vector12d = Eigen::Matrix<double, 12, 1>;

struct Match {
    Eigen::Vector3f normal, lever;
    float distance, weight, time_s;

    /// As documented: (n, lever x n).
    Vector6d row() const {
        Vector6d h;
        h << normal.cast<double>(), lever.cast<double>().cross(normal.cast<double>());
        return h;
    }
};

std::vector<Match> random_matches(std::size_t count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<float> gauss;
    std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
    const auto vector = [&](float scale) {
        return Eigen::Vector3f(scale * gauss(random), scale * gauss(random), scale * gauss(random));
    };
    std::vector<Match> matches(count);
    for (Match& m : matches) {
        m = {vector(1.0F).normalized(), vector(10.0F), 0.1F * gauss(random), 1e4F * uniform(random),
             -0.1F * uniform(random)};
    }
    return matches;
}

void fill(const std::vector<Match>& from, PlaneMatches& to) {
    to.reserve(from.size());
    to.clear();
    for (const Match& m : from) to.push(m.normal.data(), m.lever.data(), m.distance, m.weight, m.time_s, 0, 0);
}

class Counts : public testing::TestWithParam<std::size_t> {};

TEST_P(Counts, SumsAreThoseOfAPlainLoopInDoublePrecision) {
    const auto random = random_matches(GetParam(), 5);
    PlaneMatches matches;
    // What a larger set has left behind must not count.
    fill(random_matches(GetParam() + 40, 6), matches);
    fill(random, matches);
    NormalEquations equations;
    accumulate(matches, equations);
    std::array<Matrix6d, 3> A, A_abs;
    std::array<Vector6d, 2> b, b_abs;
    for (auto* M : {&A, &A_abs}) M->fill(Matrix6d::Zero());
    for (auto* v : {&b, &b_abs}) v->fill(Vector6d::Zero());
    double squares = 0.0;
    for (const Match& m : random) {
        const Vector6d h = m.row();
        const double w = static_cast<double>(m.weight), r = static_cast<double>(m.distance);
        double power = 1.0;
        for (std::size_t k = 0; k < 3; ++k, power *= static_cast<double>(m.time_s)) {
            A[k] += w * power * h * h.transpose();
            A_abs[k] += w * std::abs(power) * (h * h.transpose()).cwiseAbs();
            if (k == 2) continue;
            b[k] += w * power * r * h;
            b_abs[k] += w * std::abs(power * r) * h.cwiseAbs();
        }
        squares += w * r * r;
    }
    EXPECT_EQ(equations.count, GetParam());
    EXPECT_NEAR(equations.weighted_squares, squares, 1e-5 * squares + 1e-12);
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_TRUE(((equations.A[k] - A[k]).array().abs() <= 2e-6 * A_abs[k].array() + 1e-9).all()) << k;
        EXPECT_EQ(equations.A[k], equations.A[k].transpose());
    }
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_TRUE(((equations.b[k] - b[k]).array().abs() <= 2e-6 * b_abs[k].array() + 1e-9).all()) << k;
    }
}

INSTANTIATE_TEST_SUITE_P(NormalEquations, Counts, testing::Values(0U, 1U, 7U, 8U, 9U, 64U, 3001U));

TEST(NormalEquations, LeversAreTheirLengths) {
    PlaneMatches matches;
    const auto random = random_matches(20, 9);
    fill(random, matches);
    for (std::size_t i = 0; i < random.size(); ++i) EXPECT_FLOAT_EQ(matches.lever_m[i], random[i].lever.norm());
}

/// Distance of a point to its plane when the state is off: position, rotation, velocity, angular velocity.
double residual(const Match& m, const Vector12d& error) {
    const double dt = static_cast<double>(m.time_s);
    const Eigen::Vector3d moved = error.segment<3>(0) + dt * error.segment<3>(6);
    const Eigen::Quaterniond turned = so3_exp(error.segment<3>(3) + dt * error.segment<3>(9));
    const Eigen::Vector3d lever = m.lever.cast<double>();
    return static_cast<double>(m.distance) + m.normal.cast<double>().dot(moved + turned * lever - lever);
}

TEST(NormalEquations, GradientAndCurvatureAreThoseOfTheSumOfSquares) {
    const auto random = random_matches(200, 3);
    PlaneMatches matches;
    fill(random, matches);
    NormalEquations equations;
    accumulate(matches, equations);
    const auto cost = [&](const Vector12d& error) {
        double sum = 0.0;
        for (const Match& m : random) sum += 0.5 * static_cast<double>(m.weight) * std::pow(residual(m, error), 2);
        return sum;
    };
    Vector12d gradient;
    gradient << equations.b[0], equations.b[1];
    Eigen::Matrix<double, 12, 12> curvature;
    curvature << equations.A[0], equations.A[1], equations.A[1], equations.A[2];
    constexpr double h = 1e-6;
    for (int i = 0; i < 12; ++i) {
        const Vector12d step = h * Vector12d::Unit(i);
        const double numeric = (cost(step) - cost(-step)) / (2.0 * h);
        EXPECT_NEAR(gradient[i], numeric, 1e-3 * gradient.cwiseAbs().maxCoeff()) << i;
    }
    // Gauss and Newton leave out the second derivative of the residual: the rows are checked one by one instead.
    Eigen::Matrix<double, 12, 12> numeric = Eigen::Matrix<double, 12, 12>::Zero();
    for (const Match& m : random) {
        Vector12d row;
        for (int i = 0; i < 12; ++i) {
            const Vector12d step = h * Vector12d::Unit(i);
            row[i] = (residual(m, step) - residual(m, -step)) / (2.0 * h);
        }
        numeric += static_cast<double>(m.weight) * row * row.transpose();
    }
    EXPECT_LT((curvature - numeric).cwiseAbs().maxCoeff(), 1e-5 * numeric.cwiseAbs().maxCoeff());
}

/// Deviation of the height after so many points of weight 1e4 on each of some surfaces that face up.
double height_deviation(int surfaces, int points_each, double error_m) {
    const float up[3] = {0.0F, 0.0F, 1.0F};
    PlaneMatches matches;
    matches.reserve(static_cast<std::size_t>(surfaces * points_each));
    for (int i = 0; i < surfaces * points_each; ++i) {
        const float lever[3] = {static_cast<float>(i % 7) - 3.0F, static_cast<float>(i % 5) - 2.0F, -1.0F};
        // Points of one surface do not follow each other.
        matches.push(up, lever, 0.0F, 1e4F, 0.0F, static_cast<std::uint32_t>(1000 * (i % surfaces)), 0);
    }
    SurfaceInformation information;
    EXPECT_EQ(information.of(matches, error_m), information.of(matches, error_m));
    return 1.0 / std::sqrt(information.of(matches, error_m)(2, 2));
}

TEST(SurfaceInformation, IsThatOfIndependentPointsWhereTheMapHasNoError) {
    EXPECT_NEAR(height_deviation(10, 20, 0.0), 0.01 / std::sqrt(200.0), 1e-6);
}

TEST(SurfaceInformation, ManyPointsOfOneSurfaceTellNoMoreThanTheMapKnows) {
    EXPECT_NEAR(height_deviation(1, 1000, 0.02), 0.02, 1e-4);
    EXPECT_NEAR(height_deviation(16, 1000, 0.02), 0.02 / 4.0, 1e-4);
    // A single point has its own error, too.
    EXPECT_NEAR(height_deviation(1, 1, 0.02), std::sqrt(0.01 * 0.01 + 0.02 * 0.02), 1e-6);
}

}  // namespace
}  // namespace dlod
