#include "core/tracking/visible_shift.hpp"

#include <algorithm>

namespace dlod {

namespace {

/// Lowest and highest coordinates of a footprint.
struct Bounds {
    explicit Bounds(const OrientedBox& box) {
        const double c = std::abs(std::cos(box.yaw_rad)), s = std::abs(std::sin(box.yaw_rad));
        const Eigen::Vector2d reach =
            0.5 * Eigen::Vector2d(c * box.size_m.x() + s * box.size_m.y(), s * box.size_m.x() + c * box.size_m.y());
        low = box.center_m.head<2>() - reach;
        high = box.center_m.head<2>() + reach;
    }
    Eigen::Vector2d low, high;
};

}  // namespace

double visible_shift_m(const OrientedBox& first, const OrientedBox& now) {
    const Bounds before(first), after(now);
    Eigen::Vector2d shift = Eigen::Vector2d::Zero();
    for (int i : {0, 1}) {
        const double low = after.low(i) - before.low(i), high = after.high(i) - before.high(i);
        if (low * high <= 0.0) continue;
        shift(i) = std::max(0.0, std::min(std::abs(low), std::abs(high)) - std::abs(high - low));
    }
    return shift.norm();
}

}  // namespace dlod
