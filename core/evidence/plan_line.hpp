// A line in the ground plane: what an upright plane is, seen from above.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <span>

namespace dlod {

struct PlanLine {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    Eigen::Vector2d along = Eigen::Vector2d::UnitX();
    double spread_m = 0.0;  ///< standard deviation of its points along it
    double noise_m = 0.0;   ///< and across
    int points = 0;

    Eigen::Vector2d normal() const { return {-along.y(), along.x()}; }
    double across(const Eigen::Vector2d& p) const { return normal().dot(p - middle); }
    double at(const Eigen::Vector2d& p) const { return along.dot(p - middle); }
};

/// Least squares over the points that `use` gives: it calls its argument with each. The line points the way that
/// `start` does; with fewer than three points it is that one.
template <class Use>
PlanLine fit_line(const PlanLine& start, Use use) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    int n = 0;
    use([&](const Eigen::Vector2d& p) {
        const Eigen::Vector2d d = p - start.middle;
        sum += d;
        squares += d * d.transpose();
        ++n;
    });
    PlanLine line = start;
    line.points = n;
    if (n < 3) return line;
    const Eigen::Vector2d mean = sum / n;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(squares / n - mean * mean.transpose());
    line.middle = start.middle + mean;
    line.along = eigen.eigenvectors().col(1);
    if (line.along.dot(start.along) < 0.0) line.along = -line.along;
    line.spread_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
    line.noise_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]));
    return line;
}

/// The line that most of the points lie on, to the tolerance. Points the way that `start` does.
/// @param length_m of what is looked for: points far closer together tell no direction
PlanLine most_common_line(std::span<const Eigen::Vector2d> points, const PlanLine& start, double length_m,
                          double tolerance_m);

}  // namespace dlod
