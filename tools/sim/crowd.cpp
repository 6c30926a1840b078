#include "tools/sim/crowd.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dlod::tools::sim {
namespace {

constexpr double kStep_s = 0.02;
constexpr double kRunUp_s = 4.0;
constexpr double kMargin_s = 1.0;
constexpr double kRobotRadius_m = 0.45;

struct State {
    Vec2 p = Vec2::Zero();
    Vec2 v = Vec2::Zero();
    double heading = 0.0;
    double phase = 0.0;
    std::size_t target = 0;
    double pause_s = 0.0;
    std::vector<Eigen::Vector4d> samples;
};

/// Push away from somebody whom one would meet: the nearer in time and the closer the pass, the stronger.
Vec2 avoidance(const Vec2& p, const Vec2& v, double radius, const Vec2& other_p, const Vec2& other_v) {
    constexpr double kHorizon_s = 2.5;
    const Vec2 d = p - other_p;
    const double distance = d.norm();
    if (distance > 12.0 || distance < 1e-6) return Vec2::Zero();
    const Vec2 relative = v - other_v;
    const double closing = relative.squaredNorm();
    const double when = closing > 1e-6 ? std::clamp(-d.dot(relative) / closing, 0.0, kHorizon_s) : 0.0;
    Vec2 pass = d + when * relative;
    if (pass.norm() < 0.05) pass = Vec2(-d.y(), d.x()) * (0.05 / distance);  // head-on: both give way to one side
    const double gap = pass.norm() - radius;
    Vec2 push = pass.normalized() * 5.0 * std::exp(-std::max(gap, -0.5) / 0.35) * std::exp(-when / 1.2);
    push += d / distance * 4.0 * std::exp(-(distance - radius) / 0.15);
    return push;
}

class Simulation {
  public:
    Simulation(const std::vector<Walker>& walkers, const std::vector<Obstacle>& obstacles, const RobotMotion& robot)
        : walkers_(walkers), obstacles_(obstacles), robot_(robot), states_(walkers.size()) {
        for (std::size_t i = 0; i < walkers.size(); ++i) {
            State& s = states_[i];
            s.p = walkers[i].start;
            if (walkers[i].leader != Walker::kNobody) s.p = beside(i, -kRunUp_s);
            if (!walkers[i].route.empty()) {
                const Vec2 d = walkers[i].route.front() - s.p;
                s.heading = std::atan2(d.y(), d.x());
            }
            s.phase = 2.0 * std::numbers::pi * Random(i, 77).uniform();
        }
    }

    void step(double t) {
        const Vec2 robot_p = robot_.position(t);
        const Vec2 robot_v = robot_.velocity(t);
        std::vector<Vec2> push(states_.size(), Vec2::Zero());
        for (std::size_t i = 0; i < states_.size(); ++i) {
            const State& a = states_[i];
            if (a.pause_s > 0.0) continue;
            for (std::size_t j = 0; j < states_.size(); ++j) {
                if (j == i || accompanies(i, static_cast<int>(j)) || accompanies(j, static_cast<int>(i))) continue;
                push[i] += avoidance(a.p, a.v, walkers_[i].radius_m + walkers_[j].radius_m, states_[j].p, states_[j].v);
            }
            if (!accompanies(i, Walker::kRobot)) {
                push[i] += 1.5 * avoidance(a.p, a.v, walkers_[i].radius_m + kRobotRadius_m, robot_p, robot_v);
            }
            for (const Obstacle& o : obstacles_) {
                Vec2 away;
                const double gap = o.distance_m(a.p, away) - walkers_[i].radius_m;
                if (gap > 1.5) continue;
                push[i] += away * 3.0 * std::exp(-std::max(gap, -0.3) / 0.18);
                // Along a wall rather than into it.
                const double into = -a.v.dot(away);
                if (into > 0.0 && gap < into) push[i] += Vec2(-away.y(), away.x()) * side_of(a, away, i) * 1.5;
            }
        }
        for (std::size_t i = 0; i < states_.size(); ++i) advance(i, t, push[i]);
        for (int round = 0; round < 2; ++round) separate(robot_p);
        for (std::size_t i = 0; i < states_.size(); ++i) settle(i);
    }

    void record() {
        for (State& s : states_) s.samples.emplace_back(s.p.x(), s.p.y(), s.heading, s.phase);
    }

    Motion motion(std::size_t i) const { return {-kMargin_s, kStep_s, smoothed(states_[i].samples, 0.1 / kStep_s)}; }

  private:
    bool accompanies(std::size_t i, int leader) const { return walkers_[i].leader == leader; }

    double side_of(const State& a, const Vec2& away, std::size_t i) const {
        const Vec2 along(-away.y(), away.x());
        return (goal(i) - a.p).dot(along) < 0.0 ? -1.0 : 1.0;
    }

    Vec2 goal(std::size_t i) const {
        const Walker& w = walkers_[i];
        return w.route.empty() ? states_[i].p : w.route[states_[i].target];
    }

    /// Place beside the leader at a time.
    Vec2 beside(std::size_t i, double t) const {
        const Walker& w = walkers_[i];
        double heading = 0.0;
        Vec2 p;
        if (w.leader == Walker::kRobot) {
            const Eigen::Vector3d forward = robot_.T_world_sensor(t).linear().col(0);
            heading = std::atan2(forward.y(), forward.x());
            p = robot_.position(t);
        } else {
            heading = states_[static_cast<std::size_t>(w.leader)].heading;
            p = states_[static_cast<std::size_t>(w.leader)].p;
        }
        return p + Eigen::Rotation2Dd(heading) * w.offset;
    }

    Vec2 wanted_velocity(std::size_t i, double t) {
        State& s = states_[i];
        const Walker& w = walkers_[i];
        if (w.leader != Walker::kNobody) {
            const Vec2 v =
                w.leader == Walker::kRobot ? robot_.velocity(t) : states_[static_cast<std::size_t>(w.leader)].v;
            const Vec2 gap = beside(i, t) - s.p;
            // Small errors are nobody's concern: who stands beside a standing leader stands.
            if (v.norm() < 0.05 && gap.norm() < 0.35) return Vec2::Zero();
            const Vec2 wanted = v + 1.2 * gap;
            return wanted * std::min(1.0, (v.norm() + 1.0) / std::max(1e-9, wanted.norm()));
        }
        if (w.route.empty()) return Vec2::Zero();
        if (s.pause_s > 0.0) {
            s.pause_s -= kStep_s;
            return Vec2::Zero();
        }
        const Vec2 d = w.route[s.target] - s.p;
        if (d.norm() < w.reached_m) {
            if (!w.pause_s.empty()) s.pause_s = w.pause_s[s.target];
            s.target = (s.target + 1) % w.route.size();
        }
        return d.normalized() * w.speed_mps;
    }

    void advance(std::size_t i, double t, const Vec2& push) {
        constexpr double kResponse_s = 0.4;
        State& s = states_[i];
        const Walker& w = walkers_[i];
        const Vec2 wanted = wanted_velocity(i, t);
        Vec2 acceleration = (wanted - s.v) / kResponse_s;
        if (!wanted.isZero()) acceleration += push;
        const double size = acceleration.norm();
        if (size > w.agility_mps2) acceleration *= w.agility_mps2 / size;
        s.v += acceleration * kStep_s;
        const double fastest = std::max(1.35 * w.speed_mps, 1.1 * wanted.norm());
        if (s.v.norm() > fastest) s.v *= fastest / s.v.norm();
        if (wanted.isZero() && s.v.norm() < 0.05) s.v.setZero();
        s.p += s.v * kStep_s;
    }

    /// Nobody stands in another or in a wall, whatever the forces say; who pauses is not moved.
    void separate(const Vec2& robot_p) {
        for (std::size_t i = 0; i < states_.size(); ++i) {
            if (states_[i].pause_s > 0.0) continue;
            const double radius = walkers_[i].radius_m;
            Vec2& p = states_[i].p;
            const auto keep_off = [&](const Vec2& other, double least) {
                const Vec2 d = p - other;
                const double distance = d.norm();
                if (distance < least && distance > 1e-6) p += d / distance * std::min(least - distance, 0.03);
            };
            for (std::size_t j = 0; j < states_.size(); ++j) {
                if (j != i) keep_off(states_[j].p, 0.9 * (radius + walkers_[j].radius_m));
            }
            keep_off(robot_p, radius + kRobotRadius_m);
            for (const Obstacle& o : obstacles_) {
                Vec2 away;
                const double gap = o.distance_m(p, away) - radius;
                if (gap < 0.0) p += away * std::min(-gap, 0.03);
            }
        }
    }

    void settle(std::size_t i) {
        State& s = states_[i];
        const double speed = s.v.norm();
        if (speed > 0.15) {
            const double error = std::remainder(std::atan2(s.v.y(), s.v.x()) - s.heading, 2.0 * std::numbers::pi);
            s.heading += std::clamp(error, -6.0 * kStep_s, 6.0 * kStep_s);
        }
        s.phase += 2.0 * std::numbers::pi * speed * kStep_s / walkers_[i].stride_m(speed);
    }

    const std::vector<Walker>& walkers_;
    const std::vector<Obstacle>& obstacles_;
    const RobotMotion& robot_;
    std::vector<State> states_;
};

}  // namespace

std::vector<Motion> walk_crowd(const std::vector<Walker>& walkers, const std::vector<Obstacle>& obstacles,
                               const RobotMotion& robot, double duration_s) {
    Simulation simulation(walkers, obstacles, robot);
    const auto run_up = static_cast<int>(std::lround((kRunUp_s - kMargin_s) / kStep_s));
    const auto steps = static_cast<int>(std::ceil((kRunUp_s + duration_s + kMargin_s) / kStep_s));
    for (int i = 0; i <= steps; ++i) {
        if (i >= run_up) simulation.record();
        simulation.step(-kRunUp_s + i * kStep_s);
    }
    std::vector<Motion> motions;
    for (std::size_t i = 0; i < walkers.size(); ++i) motions.push_back(simulation.motion(i));
    return motions;
}

}  // namespace dlod::tools::sim
