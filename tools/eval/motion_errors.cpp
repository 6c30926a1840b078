#include "tools/eval/motion_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dlod::tools {
namespace {

constexpr double kHeadingFrom_mps = 0.5;  // slower motion has no heading to speak of
constexpr std::array<double, 5> kSpeeds_mps{0.0, 0.5, 2.0, 5.0, 40.0};

std::optional<double> mean(const std::vector<double>& values) {
    if (values.empty()) return std::nullopt;
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

}  // namespace

std::optional<double> quantile(const std::vector<double>& sorted, double q) {
    if (sorted.empty()) return std::nullopt;
    const double at = q * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const auto above = std::min(below + 1, sorted.size() - 1);
    return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

void MotionErrors::add(const Eigen::Vector2d& velocity_mps, const Eigen::Vector2d& true_mps) {
    const double turn = std::atan2(velocity_mps.y(), velocity_mps.x()) - std::atan2(true_mps.y(), true_mps.x());
    samples_.push_back({true_mps.norm(), (velocity_mps - true_mps).norm(), velocity_mps.norm() - true_mps.norm(),
                        std::abs(std::remainder(turn, 2.0 * std::numbers::pi)) * 180.0 / std::numbers::pi});
}

MotionErrorRow MotionErrors::row(double from_mps, double to_mps) const {
    MotionErrorRow row;
    row.from_mps = from_mps;
    row.to_mps = to_mps;
    std::vector<double> velocity, speed, heading;
    for (const Sample& sample : samples_) {
        if (sample.speed_mps < from_mps || sample.speed_mps >= to_mps) continue;
        velocity.push_back(sample.velocity_error_mps);
        speed.push_back(sample.speed_error_mps);
        if (sample.speed_mps >= kHeadingFrom_mps) heading.push_back(sample.heading_error_deg);
    }
    std::sort(velocity.begin(), velocity.end());
    std::sort(heading.begin(), heading.end());
    row.samples = static_cast<int>(velocity.size());
    row.velocity_median_mps = quantile(velocity, 0.5);
    row.velocity_p90_mps = quantile(velocity, 0.9);
    row.speed_bias_mps = mean(speed);
    row.heading_median_deg = quantile(heading, 0.5);
    row.heading_p90_deg = quantile(heading, 0.9);
    return row;
}

std::vector<MotionErrorRow> MotionErrors::table() const {
    std::vector<MotionErrorRow> rows;
    for (std::size_t i = 0; i + 1 < kSpeeds_mps.size(); ++i) rows.push_back(row(kSpeeds_mps[i], kSpeeds_mps[i + 1]));
    rows.push_back(row(kSpeeds_mps.front(), kSpeeds_mps.back()));
    return rows;
}

std::optional<double> MotionErrors::mean_velocity_mps() const {
    std::vector<double> errors;
    for (const Sample& sample : samples_) errors.push_back(sample.velocity_error_mps);
    return mean(errors);
}

std::optional<double> MotionErrors::mean_heading_deg() const {
    std::vector<double> errors;
    for (const Sample& sample : samples_) {
        if (sample.speed_mps >= kHeadingFrom_mps) errors.push_back(sample.heading_error_deg);
    }
    return mean(errors);
}

}  // namespace dlod::tools
