// What walkers and the robot keep clear of: boxes on the ground with rounded edges (discs have no box).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/sim/mesh.hpp"

namespace dlod::tools::sim {

struct Obstacle {
    Vec2 center = Vec2::Zero();
    Vec2 half_m = Vec2::Zero();
    double yaw_rad = 0.0;
    double radius_m = 0.0;

    static Obstacle disc(const Vec2& center, double radius_m) { return {center, Vec2::Zero(), 0.0, radius_m}; }
    static Obstacle box(const Vec2& center, const Vec2& size_m, double yaw_rad = 0.0) {
        return {center, 0.5 * size_m, yaw_rad, 0.0};
    }
    static Obstacle wall(const Vec2& a, const Vec2& b, double thickness_m) {
        return {
            0.5 * (a + b), {0.5 * (b - a).norm(), 0.5 * thickness_m}, std::atan2(b.y() - a.y(), b.x() - a.x()), 0.0};
    }

    /// Distance of a point from the surface, negative inside; `away`: unit vector from the obstacle to the point.
    double distance_m(const Vec2& p, Vec2& away) const {
        const Eigen::Rotation2Dd turn(yaw_rad);
        const Vec2 q = turn.inverse() * (p - center);
        const Vec2 nearest = q.cwiseMax(-half_m).cwiseMin(half_m);
        Vec2 d = q - nearest;
        double distance = d.norm();
        if (distance < 1e-9) {  // inside: out by the nearest side
            const Vec2 depth = half_m - q.cwiseAbs();
            d = depth.x() < depth.y() ? Vec2(q.x() < 0.0 ? -1.0 : 1.0, 0.0) : Vec2(0.0, q.y() < 0.0 ? -1.0 : 1.0);
            distance = -std::min(depth.x(), depth.y());
        } else {
            d /= distance;
        }
        away = turn * d;
        return distance - radius_m;
    }
};

}  // namespace dlod::tools::sim
