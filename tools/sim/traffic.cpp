#include "tools/sim/traffic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dlod::tools::sim {
namespace {

constexpr double kStep_s = 0.02;
constexpr double kMargin_s = 1.0;
constexpr double kAcceleration_mps2 = 1.6;
constexpr double kBraking_mps2 = 2.5;
constexpr double kHeadway_s = 1.3;
constexpr double kStandingGap_m = 1.8;

/// Acceleration by the Intelligent Driver Model; `gap_m` to what is ahead.
double follow(double v, double wanted, double gap_m, double closing) {
    const double safe =
        kStandingGap_m +
        std::max(0.0, v * kHeadway_s + v * closing / (2.0 * std::sqrt(kAcceleration_mps2 * kBraking_mps2)));
    const double ratio = safe / std::max(0.1, gap_m);
    return kAcceleration_mps2 * (1.0 - std::pow(v / wanted, 4.0) - ratio * ratio);
}

}  // namespace

std::vector<Motion> drive_lane(const ArcPath& lane, const std::vector<Driver>& drivers,
                               const std::vector<StopLine>& stops, double duration_s) {
    struct State {
        double s;
        double v;
        std::vector<Eigen::Vector4d> samples;
    };
    std::vector<State> states;
    for (const Driver& d : drivers) states.push_back({d.s_m - 0.9 * d.speed_mps * kMargin_s, 0.9 * d.speed_mps, {}});
    const auto steps = static_cast<int>(std::ceil((duration_s + 2.0 * kMargin_s) / kStep_s));
    for (int i = 0; i <= steps; ++i) {
        const double t = -kMargin_s + i * kStep_s;
        for (std::size_t k = 0; k < states.size(); ++k) {
            State& s = states[k];
            const Driver& d = drivers[k];
            const Vec2 p = lane.point(s.s);
            s.samples.emplace_back(p.x(), p.y(), lane.heading(s.s), 2.0 * std::numbers::pi * s.s / d.stride_m);
            double a = follow(s.v, d.speed_mps, 1e6, 0.0);
            if (k > 0) {
                const double gap = states[k - 1].s - s.s - 0.5 * (drivers[k - 1].length_m + d.length_m);
                a = std::min(a, follow(s.v, d.speed_mps, gap, s.v - states[k - 1].v));
            }
            for (const StopLine& stop : stops) {
                const double gap = stop.s_m - s.s - 0.5 * d.length_m + kStandingGap_m;
                const bool closed = std::any_of(stop.closed_s.begin(), stop.closed_s.end(),
                                                [t](const auto& c) { return t >= c.first && t < c.second; });
                // Who cannot stop any more drives on.
                if (closed && gap > 0.0 && s.v * s.v / (2.0 * 5.0) < gap) {
                    a = std::min(a, follow(s.v, d.speed_mps, gap, s.v));
                }
            }
            s.v = std::max(0.0, s.v + std::clamp(a, -5.0, kAcceleration_mps2) * kStep_s);
            if (s.v < 0.02 && a < 0.05) s.v = 0.0;
            s.s += s.v * kStep_s;
        }
    }
    std::vector<Motion> motions;
    for (State& s : states) motions.emplace_back(-kMargin_s, kStep_s, smoothed(s.samples, 0.1 / kStep_s));
    return motions;
}

}  // namespace dlod::tools::sim
