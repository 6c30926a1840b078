#include "core/tracking/box_iou.hpp"

#include <algorithm>
#include <array>

namespace dlod {

namespace {

using Point = Eigen::Vector2d;

/// A convex polygon; four clips of a rectangle leave at most eight corners.
struct Polygon {
    std::array<Point, 12> corner;
    int size = 0;
    void add(const Point& p) { corner[static_cast<std::size_t>(size++)] = p; }
    const Point& operator[](int i) const { return corner[static_cast<std::size_t>(i)]; }
};

/// Keeps the part where normal . p <= offset (Sutherland and Hodgman).
Polygon clip(const Polygon& in, const Point& normal, double offset) {
    Polygon out;
    for (int i = 0; i < in.size; ++i) {
        const Point& a = in[i];
        const Point& b = in[i + 1 == in.size ? 0 : i + 1];
        const double da = normal.dot(a) - offset;
        const double db = normal.dot(b) - offset;
        if (da <= 0.0) out.add(a);
        if ((da < 0.0 && db > 0.0) || (da > 0.0 && db < 0.0)) out.add(a + (b - a) * (da / (da - db)));
    }
    return out;
}

double area(const Polygon& p) {
    double twice = 0.0;
    for (int i = 0; i < p.size; ++i) {
        const Point& a = p[i];
        const Point& b = p[i + 1 == p.size ? 0 : i + 1];
        twice += a.x() * b.y() - a.y() * b.x();
    }
    return 0.5 * std::abs(twice);
}

double volume(const OrientedBox& box) {
    return box.size_m.prod();
}
double footprint(const OrientedBox& box) {
    return box.size_m.x() * box.size_m.y();
}

}  // namespace

double footprint_intersection_m2(const OrientedBox& a, const OrientedBox& b) {
    const Point between = b.center_m.head<2>() - a.center_m.head<2>();
    // Circumscribed circles that do not meet: the usual case, and no trigonometry.
    const double reach = 0.5 * (a.size_m.head<2>().norm() + b.size_m.head<2>().norm());
    if (between.squaredNorm() >= reach * reach) return 0.0;

    // In the axes of a, about its centre.
    const double ca = std::cos(a.yaw_rad), sa = std::sin(a.yaw_rad);
    const Point center(ca * between.x() + sa * between.y(), -sa * between.x() + ca * between.y());
    const double c = std::cos(b.yaw_rad - a.yaw_rad), s = std::sin(b.yaw_rad - a.yaw_rad);
    const Point along = 0.5 * b.size_m.x() * Point(c, s);
    const Point across = 0.5 * b.size_m.y() * Point(-s, c);
    Polygon p;
    p.add(center + along + across);
    p.add(center - along + across);
    p.add(center - along - across);
    p.add(center + along - across);
    p = clip(p, Point(1.0, 0.0), 0.5 * a.size_m.x());
    p = clip(p, Point(-1.0, 0.0), 0.5 * a.size_m.x());
    p = clip(p, Point(0.0, 1.0), 0.5 * a.size_m.y());
    p = clip(p, Point(0.0, -1.0), 0.5 * a.size_m.y());
    return area(p);
}

double shared_footprint(const OrientedBox& a, const OrientedBox& b) {
    const double smaller = std::min(footprint(a), footprint(b));
    return smaller > 0.0 ? footprint_intersection_m2(a, b) / smaller : 0.0;
}

double footprint_iou(const OrientedBox& a, const OrientedBox& b) {
    const double both = footprint_intersection_m2(a, b);
    const double either = footprint(a) + footprint(b) - both;
    return either > 0.0 ? both / either : 0.0;
}

double box_iou(const OrientedBox& a, const OrientedBox& b) {
    const double top = std::min(a.center_m.z() + 0.5 * a.size_m.z(), b.center_m.z() + 0.5 * b.size_m.z());
    const double bottom = std::max(a.center_m.z() - 0.5 * a.size_m.z(), b.center_m.z() - 0.5 * b.size_m.z());
    if (top <= bottom) return 0.0;
    const double both = footprint_intersection_m2(a, b) * (top - bottom);
    const double either = volume(a) + volume(b) - both;
    return either > 0.0 ? both / either : 0.0;
}

Footprint::Footprint(const OrientedBox& box)
    : center_m_(box.center_m),
      cosine_(std::cos(box.yaw_rad)),
      sine_(std::sin(box.yaw_rad)),
      half_length_m_(0.5 * box.size_m.x()),
      half_width_m_(0.5 * box.size_m.y()) {}

double footprint_distance_m(const OrientedBox& box, const Eigen::Vector3d& point_m) {
    return Footprint(box).distance_m(point_m);
}

double height_gap_m(const OrientedBox& a, const OrientedBox& b) {
    return std::abs(a.center_m.z() - b.center_m.z()) - 0.5 * (a.size_m.z() + b.size_m.z());
}

double reach_m(const OrientedBox& box) {
    return 0.5 * box.size_m.head<2>().norm();
}

double width_along(const OrientedBox& box, const Eigen::Vector2d& axis) {
    const double c = std::cos(box.yaw_rad), s = std::sin(box.yaw_rad);
    return std::abs(axis.x() * c + axis.y() * s) * box.size_m.x() +
           std::abs(axis.y() * c - axis.x() * s) * box.size_m.y();
}

Eigen::Vector2d joint_size(const OrientedBox& a, const OrientedBox& b, double yaw_rad) {
    const Eigen::Vector2d along(std::cos(yaw_rad), std::sin(yaw_rad));
    const Eigen::Vector2d across(-along.y(), along.x());
    const auto reach = [&](const Eigen::Vector2d& axis) {
        const double at = axis.dot((b.center_m - a.center_m).head<2>());
        const double half_a = 0.5 * width_along(a, axis), half_b = 0.5 * width_along(b, axis);
        return std::max(half_a, at + half_b) - std::min(-half_a, at - half_b);
    };
    return {reach(along), reach(across)};
}

double share_inside(const OrientedBox& part, OrientedBox box, double margin_m) {
    box.size_m.head<2>().array() += 2.0 * margin_m;
    return footprint_intersection_m2(part, box) / (part.size_m.x() * part.size_m.y());
}

}  // namespace dlod
