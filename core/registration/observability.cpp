#include "core/registration/observability.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

// A direction with more than this share of the strongest one's information is not examined further.
constexpr double kClearShare = 0.1;
// A match faces a direction of translation from this cosine on, one of rotation from this share of its lever on.
constexpr float kFacingCosine = 0.3F;
constexpr float kFacingLever = 0.1F;
// As many facing matches make a direction observable, or as many per thousand of all.
constexpr double kFacingMatches = 15.0;
constexpr double kFacingPerMille = 5.0;

/// Number of matches that face the direction.
double facing_matches(const PlaneMatches& matches, int block, const Eigen::Vector3f& u) {
    double facing = 0.0;
    for (std::size_t i = 0; i < matches.count; ++i) {
        const auto b = static_cast<std::size_t>(block);
        const float along =
            std::abs(matches.h[b][i] * u.x() + matches.h[b + 1][i] * u.y() + matches.h[b + 2][i] * u.z());
        if (along > (block == 0 ? kFacingCosine : kFacingLever * matches.lever_m[i])) facing += 1.0;
    }
    return facing;
}

}  // namespace

Observability observe(const PlaneMatches& matches, const NormalEquations& equations) {
    Observability result;
    const double least = std::max(kFacingMatches, 1e-3 * kFacingPerMille * static_cast<double>(matches.count));
    for (const int block : {0, 3}) {
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
        const Eigen::Matrix3d information = equations.A[0].block<3, 3>(block, block);
        solver.computeDirect(information);
        for (int k = 0; k < 3; ++k) {
            if (solver.eigenvalues()[k] > kClearShare * solver.eigenvalues()[2]) break;
            const Eigen::Vector3d u = solver.eigenvectors().col(k);
            if (facing_matches(matches, block, u.cast<float>()) >= least) continue;
            result.projector.block<3, 3>(block, block) -= u * u.transpose();
            ++result.unobservable;
        }
    }
    return result;
}

void project(const Observability& observability, NormalEquations& equations) {
    if (observability.unobservable == 0) return;
    const Matrix6d& P = observability.projector;
    for (Matrix6d& A : equations.A) A = (P * A * P).eval();
    for (Vector6d& b : equations.b) b = (P * b).eval();
}

}  // namespace dlod
