#include "core/evidence/plan_line.hpp"

namespace dlod {
namespace {

constexpr std::size_t kTrials = 24;  // points of which each two are tried as a line
constexpr double kApart = 0.25;      // of the length between them

}  // namespace

PlanLine most_common_line(std::span<const Eigen::Vector2d> points, const PlanLine& start, double length_m,
                          double tolerance_m) {
    const std::size_t n = std::min<std::size_t>(points.size(), kTrials);
    const auto sample = [&](std::size_t k) -> const Eigen::Vector2d& { return points[k * points.size() / n]; };
    PlanLine best = start;
    int most = -1;
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = i + 1; j < n; ++j) {
            const Eigen::Vector2d d = sample(j) - sample(i);
            const double length = d.norm();
            if (length < kApart * length_m) continue;
            PlanLine line;
            line.middle = sample(i);
            line.along = d / length;
            int near = 0;
            for (std::size_t k = 0; k < n; ++k) near += std::abs(line.across(sample(k))) < tolerance_m ? 1 : 0;
            if (near <= most) continue;
            most = near;
            best = line;
        }
    }
    if (best.along.dot(start.along) < 0.0) best.along = -best.along;
    for (int round = 0; round < 2; ++round) {
        const PlanLine rough = best;
        best = fit_line(rough, [&](auto add) {
            for (const Eigen::Vector2d& p : points) {
                if (std::abs(rough.across(p)) < tolerance_m) add(p);
            }
        });
    }
    return best;
}

}  // namespace dlod
