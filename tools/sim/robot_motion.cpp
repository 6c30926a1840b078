#include "tools/sim/robot_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "core/types/lie.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kKnot_s = 0.01;
constexpr double kMargin_s = 1.0;  ///< before the drive's start and after its end
constexpr double kSmoothing_s = 0.08;

/// Speeds allowed along the path: bends taken at a lateral acceleration, braked for in time.
class SpeedLimit {
  public:
    SpeedLimit(const ArcPath& path, double speed_mps, double braking_mps2, bool wraps) : path_(path), wraps_(wraps) {
        constexpr double kLateral_mps2 = 2.5;
        const auto n = static_cast<std::size_t>(std::ceil(path.length_m() / kStep_m)) + 1;
        limit_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            const double bend = path.curvature(static_cast<double>(i) * kStep_m);
            limit_[i] = std::min(speed_mps, std::sqrt(kLateral_mps2 / std::max(1e-6, bend)));
        }
        if (!wraps) limit_.back() = 0.0;
        for (int lap = 0; lap < (wraps ? 2 : 1); ++lap) {
            double next = wraps ? limit_.front() : limit_.back();
            for (std::size_t i = n; i-- > 0;) {
                limit_[i] = std::min(limit_[i], std::sqrt(next * next + 2.0 * braking_mps2 * kStep_m));
                next = limit_[i];
            }
        }
    }

    double at(double s) const {
        if (wraps_) s -= std::floor(s / path_.length_m()) * path_.length_m();
        const auto i = static_cast<std::size_t>(std::clamp(s / kStep_m, 0.0, static_cast<double>(limit_.size() - 1)));
        return limit_[i];
    }

  private:
    static constexpr double kStep_m = 0.05;
    const ArcPath& path_;
    bool wraps_;
    std::vector<double> limit_;
};

/// The ground as wheels or feet half a metre apart feel it.
double ground_below(const Terrain& terrain, const Vec2& p, double heading) {
    constexpr double kReach_m = 0.35;
    const Vec2 along(std::cos(heading), std::sin(heading));
    double sum = 0.0;
    for (int i = -3; i <= 3; ++i) {
        const Vec2 q = p + along * (kReach_m * i / 3.0);
        sum += terrain(q.x(), q.y()) / 7.0;
    }
    return sum;
}

/// From 0 to 1 over `t` from 0 to `length`, with a trapezoidal rate.
double ramp(double t, double length, double rise) {
    const double top = 1.0 / (length - rise);
    if (t <= 0.0) return 0.0;
    if (t >= length) return 1.0;
    if (t < rise) return 0.5 * top * t * t / rise;
    if (t > length - rise) return 1.0 - 0.5 * top * (length - t) * (length - t) / rise;
    return top * (t - 0.5 * rise);
}

}  // namespace

RobotMotion::RobotMotion(const ArcPath& path, const Terrain& terrain, const RobotOptions& options, double duration_s) {
    const double acceleration = std::max(1.0, 0.5 * options.speed_mps);
    const SpeedLimit limit(path, options.speed_mps, acceleration, path.closed() && !options.lap);
    const bool from_rest = options.standing_s > 0.0;
    double v = from_rest ? 0.0 : limit.at(0.0);
    double s = from_rest ? 0.0 : -v * kMargin_s;
    double gait = 0.0;

    const auto knots = static_cast<int>(std::ceil((duration_s + 2.0 * kMargin_s) / kKnot_s)) + 1;
    std::vector<double> ways_m;
    std::vector<double> speeds_mps;
    for (int i = 0; i < knots; ++i) {
        const double t = -kMargin_s + i * kKnot_s;
        if (t >= options.standing_s || !from_rest) {
            v = std::clamp(limit.at(s), v - 2.0 * acceleration * kKnot_s, v + acceleration * kKnot_s);
            s += v * kKnot_s;
        }
        ways_m.push_back(s);
        speeds_mps.push_back(v);
    }
    if (options.lap) {
        if (!path.closed()) throw std::invalid_argument("a lap is possible in scenes with a closed path only");
        if (s < path.length_m()) {
            throw std::invalid_argument("the lap is not complete: after " + std::to_string(duration_s) + " s, " +
                                        std::to_string(s) + " of " + std::to_string(path.length_m()) + " m");
        }
        // It stops a few centimetres too far.
        for (double& way_m : ways_m) way_m *= path.length_m() / s;
    }
    std::vector<Vector6d> samples;
    for (int i = 0; i < knots; ++i) {
        const double t = -kMargin_s + i * kKnot_s;
        s = ways_m[static_cast<std::size_t>(i)];
        v = speeds_mps[static_cast<std::size_t>(i)];
        // A stride's frequency grows with the speed; who stands does not wobble.
        const double pace = options.wobble ? std::min(1.0, v / 0.8) : 0.0;
        gait += 2.0 * std::numbers::pi * std::min(2.6, 1.5 + 0.3 * v) * kKnot_s * (pace > 0.0 ? 1.0 : 0.0);
        const double heading = path.heading(s);
        const Vec2 p = path.point(s);
        const Vec2 ahead(0.3 * std::cos(heading), 0.3 * std::sin(heading));
        const Vec2 left(-0.3 * std::sin(heading), 0.3 * std::cos(heading));
        const auto ground = [&](const Vec2& q) { return ground_below(terrain, q, heading); };
        const double pitch = -std::atan2(ground(p + ahead) - ground(p - ahead), 0.6);
        const double roll = std::atan2(ground(p + left) - ground(p - left), 0.6);
        Vector6d k;
        k << p, ground(p) + options.sensor_height_m + pace * 0.009 * std::sin(gait),
            roll + pace * (0.011 * std::sin(0.5 * gait) + 0.008 * std::sin(1.7 * t + 0.5)),
            pitch + pace * (0.009 * std::sin(gait + 1.0) + 0.008 * std::sin(2.3 * t)),
            heading + pace * 0.006 * std::sin(0.5 * gait + 2.0);
        samples.push_back(k);
    }
    samples = smoothed(samples, kSmoothing_s / kKnot_s);

    for (std::size_t i = 0; i < samples.size(); ++i) {
        const double t = -kMargin_s + static_cast<double>(i) * kKnot_s;
        for (const double start : options.turns_s) {
            constexpr double kRate_radps = 5.0;
            constexpr double kRise_s = 0.35;
            constexpr double kLength_s = 2.0 * std::numbers::pi / kRate_radps + kRise_s;
            samples[i][5] += 2.0 * std::numbers::pi * ramp(t - start, kLength_s, kRise_s);
        }
        for (const double start : options.kicks_s) {
            // A jolt that swings back: its acceleration peaks at about 2 g.
            constexpr double kTime_s = 0.06;
            const double u = (t - start) / kTime_s;
            if (u <= 0.0) continue;
            const double jolt = u * u * std::exp(-u);
            samples[i][0] -= 0.055 * jolt * std::sin(samples[i][5]);
            samples[i][1] += 0.055 * jolt * std::cos(samples[i][5]);
            samples[i][3] += 0.06 * jolt;
            samples[i][5] += 0.05 * jolt;
        }
    }
    channels_ = Spline<6>(-kMargin_s, kKnot_s, std::move(samples));
}

Eigen::Isometry3d RobotMotion::T_world_sensor(double t) const {
    const Vector6d c = channels_(t);
    const Eigen::Quaterniond q = Eigen::AngleAxisd(c[5], Vec3::UnitZ()) * Eigen::AngleAxisd(c[4], Vec3::UnitY()) *
                                 Eigen::AngleAxisd(c[3], Vec3::UnitX());
    return make_pose(q, c.head<3>());
}

}  // namespace dlod::tools::sim
