#include "core/registration/observability.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace dlod {
namespace {

// A direction with more than this share of the strongest one's information is not examined further.
constexpr double kClearShare = 0.1;
// A match faces a direction of rotation from this share of its lever on.
constexpr float kFacingLever = 0.1F;
// As many facing matches make a direction observable. In a bare tunnel there is none; how much they say is weighed
// against the prediction by their information.
constexpr double kFacingMatches = 5.0;
// Up to so many are looked at closely. Wherever the pose is, all matches of a surface are about equally far from it:
// those that scatter by more than this lie on an edge, whose voxel's one plane is tilted at random, or on people.
constexpr std::size_t kFewMatches = 64;
constexpr float kScatter_m = 0.05F;
// A match so many standard deviations from what the prediction says has a quarter of its weight.
constexpr float kSurprise = 2.0F;
// With less than this share of those matches' weight left the prediction is not believed.
constexpr float kLeastAgreement = 0.25F;

/// The part of a match along a direction.
float part_along(const PlaneMatches& matches, std::size_t i, int block, const Eigen::Vector3f& u) {
    const auto b = static_cast<std::size_t>(block);
    return matches.h[b][i] * u.x() + matches.h[b + 1][i] * u.y() + matches.h[b + 2][i] * u.z();
}

bool faces(const PlaneMatches& matches, std::size_t i, int block, float along) {
    return block == 0 ? Observability::is_facing(along) : std::abs(along) > kFacingLever * matches.lever_m[i];
}

/// Number of matches that face a direction and, where these are few, agree with the others on their surface.
double facing_matches(const PlaneMatches& matches, int block, const Eigen::Vector3f& u) {
    std::array<std::size_t, kFewMatches> few;
    std::size_t count = 0;
    for (std::size_t i = 0; i < matches.count; ++i) {
        if (!faces(matches, i, block, part_along(matches, i, block, u))) continue;
        if (count < kFewMatches) few[count] = i;
        ++count;
    }
    if (count > kFewMatches) return static_cast<double>(count);
    const auto agrees = [&](std::size_t i) {
        float sum = 0.0F;
        float on_surface = 0.0F;
        for (std::size_t k = 0; k < count; ++k) {
            if (matches.surface[few[k]] != matches.surface[i]) continue;
            sum += matches.residual[few[k]];
            on_surface += 1.0F;
        }
        return std::abs(matches.residual[i] - sum / on_surface) < kScatter_m;
    };
    return static_cast<double>(std::count_if(few.begin(), few.begin() + count, agrees));
}

}  // namespace

Observability Observability::of(const PlaneMatches& matches, const NormalEquations& equations, double demand) {
    Observability result;
    const double least = demand * kFacingMatches;
    for (const int block : {0, 3}) {
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
        const Eigen::Matrix3d information = equations.A[0].block<3, 3>(block, block);
        solver.computeDirect(information);
        for (int k = 0; k < 3; ++k) {
            if (solver.eigenvalues()[k] > kClearShare * solver.eigenvalues()[2]) break;
            const Eigen::Vector3f u = solver.eigenvectors().col(k).cast<float>();
            if (facing_matches(matches, block, u) >= least) {
                result.weak_[static_cast<std::size_t>(result.weak_count_++)] = {u, block};
            } else {
                result.directions_.block<3, 1>(block, result.unobservable_++) = solver.eigenvectors().col(k);
            }
        }
    }
    return result;
}

void Observability::leave_facing(PlaneMatches& matches) const {
    for (int k = 0; k < weak_count_; ++k) {
        const auto& [u, block] = weak_[static_cast<std::size_t>(k)];
        const auto b = static_cast<std::size_t>(block);
        for (std::size_t i = 0; i < matches.count; ++i) {
            const float along = part_along(matches, i, block, u);
            if (faces(matches, i, block, along)) continue;
            for (std::size_t j = 0; j < 3; ++j) matches.h[b + j][i] -= along * u[static_cast<Eigen::Index>(j)];
        }
    }
}

void Observability::ask_prediction(PlaneMatches& matches, const Vector6d& change, const Matrix6d& covariance) const {
    const Eigen::Matrix<float, 6, 1> moved = change.cast<float>();
    const Eigen::Matrix<float, 6, 6> prior = covariance.cast<float>();
    /// By how much a match weighs less; 1 for those that nobody asks about.
    const auto fall = [&](std::size_t i) {
        bool asked = false;
        for (int k = 0; k < weak_count_; ++k) {
            const auto& [u, block] = weak_[static_cast<std::size_t>(k)];
            asked = asked || (block == 0 && faces(matches, i, block, part_along(matches, i, block, u)));
        }
        if (!asked || matches.weight[i] <= 0.0F) return 1.0F;
        Eigen::Matrix<float, 6, 1> h;
        for (std::size_t j = 0; j < 6; ++j) h[static_cast<Eigen::Index>(j)] = matches.h[j][i];
        const float surprise = matches.residual[i] - h.dot(moved);
        const float variance = h.dot(prior * h) + 1.0F / matches.weight[i];
        const float root = 1.0F / (1.0F + surprise * surprise / (kSurprise * kSurprise * variance));
        return root * root;
    };
    // Where next to nothing agrees with the prediction, it is the prediction that is wrong.
    float all = 0.0F;
    float agreeing = 0.0F;
    for (std::size_t i = 0; i < matches.count; ++i) {
        if (const float f = fall(i); f < 1.0F) {
            all += matches.weight[i];
            agreeing += f * matches.weight[i];
        }
    }
    if (agreeing < kLeastAgreement * all) return;
    for (std::size_t i = 0; i < matches.count; ++i) matches.weight[i] *= fall(i);
}

}  // namespace dlod
