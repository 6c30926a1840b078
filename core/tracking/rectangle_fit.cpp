#include "core/tracking/rectangle_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace dlod {

namespace {

constexpr std::size_t kPoints = 48;  // are enough, evenly taken
constexpr std::size_t kFewest = 12;
constexpr int kDirections = 18;
constexpr int kRefinements = 3;
constexpr float kFar_m = 0.3F;  // what is farther from all sides is no part of one
constexpr double kClear = 0.6;  // of the mean cost of all directions

struct Sample {
    std::array<float, kPoints> x, y;
    std::size_t size = 0;
};

double mean_distance(const Sample& s, double yaw_rad) {
    const auto c = static_cast<float>(std::cos(yaw_rad)), n = static_cast<float>(std::sin(yaw_rad));
    std::array<float, kPoints> u, v;
    float low_u = 1e9F, high_u = -1e9F, low_v = 1e9F, high_v = -1e9F;
    for (std::size_t i = 0; i < s.size; ++i) {
        u[i] = c * s.x[i] + n * s.y[i];
        v[i] = c * s.y[i] - n * s.x[i];
        low_u = std::min(low_u, u[i]);
        high_u = std::max(high_u, u[i]);
        low_v = std::min(low_v, v[i]);
        high_v = std::max(high_v, v[i]);
    }
    float sum = 0.0F;
    for (std::size_t i = 0; i < s.size; ++i) {
        const float du = std::min(u[i] - low_u, high_u - u[i]);
        const float dv = std::min(v[i] - low_v, high_v - v[i]);
        sum += std::min(std::min(du, dv), kFar_m);
    }
    return static_cast<double>(sum) / static_cast<double>(s.size);
}

}  // namespace

std::optional<double> rectangle_yaw(const PointSpan& points) {
    if (points.size() < kFewest) return std::nullopt;
    Sample s;
    const std::size_t step = (points.size() + kPoints - 1) / kPoints;
    for (std::size_t i = step / 2; i < points.size(); i += step) {
        s.x[s.size] = points.x[i];
        s.y[s.size] = points.y[i];
        ++s.size;
    }
    const double quarter = 0.5 * std::numbers::pi;
    double step_rad = quarter / kDirections;
    double best_yaw = 0.0, best = 0.0, sum = 0.0;
    for (int k = 0; k < kDirections; ++k) {
        const double cost = mean_distance(s, k * step_rad);
        sum += cost;
        if (k == 0 || cost < best) {
            best = cost;
            best_yaw = k * step_rad;
        }
    }
    if (best > kClear * sum / kDirections) return std::nullopt;
    for (int k = 0; k < kRefinements; ++k) {
        step_rad *= 0.5;
        const double middle = best_yaw;
        for (const double yaw : {middle - step_rad, middle + step_rad}) {
            const double cost = mean_distance(s, yaw);
            if (cost < best) {
                best = cost;
                best_yaw = yaw;
            }
        }
    }
    return best_yaw - quarter * std::floor(best_yaw / quarter);
}

}  // namespace dlod
