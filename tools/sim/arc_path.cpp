#include "tools/sim/arc_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tools/sim/spline.hpp"

namespace dlod::tools::sim {

ArcPath::ArcPath(const std::vector<Vec2>& corners, bool closed, double corner_m) : closed_(closed) {
    std::vector<Eigen::Vector2d> knots;
    const std::size_t pieces = closed ? corners.size() : corners.size() - 1;
    for (std::size_t i = 0; i < pieces; ++i) {
        const Vec2& a = corners[i];
        const Vec2& b = corners[(i + 1) % corners.size()];
        const int n = std::max(1, static_cast<int>(std::lround((b - a).norm() / corner_m)));
        for (int k = 0; k < n; ++k) knots.emplace_back(a + (b - a) * (static_cast<double>(k) / n));
    }
    const auto count = static_cast<int>(knots.size());
    if (closed) {  // three more on each side, so that the spline closes smoothly
        std::vector<Eigen::Vector2d> wrapped;
        for (int i = -3; i < count + 3; ++i) wrapped.push_back(knots[static_cast<std::size_t>((i + count) % count)]);
        knots = std::move(wrapped);
    } else {  // mirrored at its ends, so that the spline passes through them
        knots.push_back(corners.back());
        const std::size_t n = knots.size();
        knots.emplace_back(2.0 * knots[n - 1] - knots[n - 2]);
        knots.insert(knots.begin(), 2.0 * knots[0] - knots[1]);
    }
    const Spline<2> spline(closed ? -3.0 : -1.0, 1.0, knots);

    // Finely along the spline's own parameter, then evenly along its length.
    constexpr int kFine = 50;
    std::vector<double> length{0.0};
    std::vector<Vec2> points{spline(0.0)};
    const int fine = count * kFine;
    for (int i = 1; i <= fine; ++i) {
        points.emplace_back(spline(static_cast<double>(i) / kFine));
        length.push_back(length.back() + (points.back() - points[points.size() - 2]).norm());
    }
    length_m_ = length.back();
    const int samples = std::max(2, static_cast<int>(std::lround(length_m_ / step_m_)));
    step_m_ = length_m_ / samples;
    std::size_t j = 0;
    for (int i = 0; i <= samples; ++i) {
        const double s = i * step_m_;
        while (j + 2 < length.size() && length[j + 1] < s) ++j;
        const double f = (s - length[j]) / std::max(1e-12, length[j + 1] - length[j]);
        const Vec2 p = points[j] + f * (points[j + 1] - points[j]);
        x_.push_back(p.x());
        y_.push_back(p.y());
    }
    double previous = 0.0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
        const std::size_t last = x_.size() - 1;
        std::size_t a = i > 0 ? i - 1 : 0;
        std::size_t b = i < last ? i + 1 : last;
        if (closed && i == 0) a = last - 1;
        if (closed && i == last) b = 1;
        const double direction = std::atan2(y_[b] - y_[a], x_[b] - x_[a]);
        previous = i == 0 ? direction : previous + std::remainder(direction - previous, 2.0 * std::numbers::pi);
        heading_.push_back(previous);
    }
    turn_rad_ = heading_.back() - heading_.front();
}

double ArcPath::at(const std::vector<double>& values, double s) const {
    const double u = s / step_m_;
    const auto last = static_cast<double>(values.size() - 1);
    const double i = std::clamp(std::floor(u), 0.0, last - 1.0);
    const auto k = static_cast<std::size_t>(i);
    return values[k] + (u - i) * (values[k + 1] - values[k]);  // goes on straight beyond the ends
}

Vec2 ArcPath::point(double s) const {
    if (closed_) s -= std::floor(s / length_m_) * length_m_;
    return {at(x_, s), at(y_, s)};
}

double ArcPath::heading(double s) const {
    if (!closed_) return at(heading_, std::clamp(s, 0.0, length_m_));
    const double turns = std::floor(s / length_m_);
    return at(heading_, s - turns * length_m_) + turns * turn_rad_;
}

double ArcPath::curvature(double s) const {
    constexpr double kReach_m = 0.15;
    return std::abs(heading(s + kReach_m) - heading(s - kReach_m)) / (2.0 * kReach_m);
}

double ArcPath::distance_m(const Vec2& p) const {
    double best = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < x_.size(); i += 4) best = std::min(best, (p - Vec2(x_[i], y_[i])).squaredNorm());
    return std::sqrt(best);
}

}  // namespace dlod::tools::sim
