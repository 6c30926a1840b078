#include "core/tracking/object_extent.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {

namespace {

constexpr double kNotSeen = 10.0;  // standard deviation of what was not measured, m or rad
constexpr double kOblique = 0.35;  // sine of 20 degrees: a side seen flatter than that hides nothing
constexpr double kCarWidth_m = 1.8;

/// Which ends of an axis of the box are hidden.
struct HiddenEnds {
    bool low = false, high = false;
};

HiddenEnds hidden_ends(const Eigen::Vector2d& axis, const OrientedBox& box, const Visibility& visibility) {
    const Eigen::Vector2d to_box = (box.center_m - visibility.sensor_m).head<2>();
    const double distance = std::max(1e-6, to_box.norm());
    const double away = axis.dot(to_box) / distance;
    const double left = axis.dot(Eigen::Vector2d(-to_box.y(), to_box.x())) / distance;
    HiddenEnds hidden;
    hidden.high = away > kOblique || (left > kOblique && visibility.occluded_left) ||
                  (left < -kOblique && visibility.occluded_right);
    hidden.low = away < -kOblique || (left < -kOblique && visibility.occluded_left) ||
                 (left > kOblique && visibility.occluded_right);
    return hidden;
}

struct CompletedSide {
    double shift_m = 0.0;  ///< of the centre from that of the visible side
    double size_m = 0.0;
    double position_sd_m = 0.0;
    double size_sd_m = 0.0;
};

/// @param toward_remembered where the remembered centre lies along the axis, from the visible one
CompletedSide complete_side(double visible_m, double remembered_m, double toward_remembered, HiddenEnds hidden,
                            const KalmanConfig& config) {
    CompletedSide side{0.0, visible_m, config.position_sd_m, config.size_sd_m};
    const double missing = remembered_m - visible_m;
    if (missing <= 0.0 || (!hidden.low && !hidden.high)) {
        // A limb that is stretched out for a moment is not the object's size: seen ends move it by a little.
        side.position_sd_m += 0.25 * std::abs(missing);
        return side;
    }
    side.size_m = remembered_m;
    side.size_sd_m = kNotSeen;
    if (hidden.low && hidden.high) {
        side.shift_m = std::clamp(toward_remembered, -0.5 * missing, 0.5 * missing);
        side.position_sd_m += 0.5 * missing;
    } else {
        side.shift_m = hidden.high ? 0.5 * missing : -0.5 * missing;
        side.position_sd_m += 0.15 * missing;
    }
    return side;
}

}  // namespace

BoxMeasurement complete_extent(const OrientedBox& visible, const OrientedBox& remembered, const Visibility& visibility,
                               const KalmanConfig& config) {
    const Eigen::Vector2d along(std::cos(visible.yaw_rad), std::sin(visible.yaw_rad));
    const Eigen::Vector2d across(-along.y(), along.x());
    const Eigen::Vector2d toward = (remembered.center_m - visible.center_m).head<2>();
    const CompletedSide length = complete_side(visible.size_m.x(), remembered.size_m.x(), along.dot(toward),
                                               hidden_ends(along, visible, visibility), config);
    const CompletedSide width = complete_side(visible.size_m.y(), remembered.size_m.y(), across.dot(toward),
                                              hidden_ends(across, visible, visibility), config);
    BoxMeasurement m;
    m.box = visible;
    m.box.center_m.head<2>() += length.shift_m * along + width.shift_m * across;
    m.box.size_m.x() = length.size_m;
    m.box.size_m.y() = width.size_m;
    m.plane_covariance = length.position_sd_m * length.position_sd_m * along * along.transpose() +
                         width.position_sd_m * width.position_sd_m * across * across.transpose();
    m.z_sd_m = config.position_sd_m + 0.25 * std::abs(remembered.size_m.z() - visible.size_m.z());
    m.yaw_sd_rad = kNotSeen;
    m.size_sd_m = Eigen::Vector3d(length.size_sd_m, width.size_sd_m, config.size_sd_m);
    return m;
}

OrientedBox assumed_box(const OrientedBox& visible, const Visibility& visibility) {
    const Eigen::Vector2d to_box = (visible.center_m - visibility.sensor_m).head<2>();
    const double distance = std::max(1e-6, to_box.norm());
    const Eigen::Vector2d along(std::cos(visible.yaw_rad), std::sin(visible.yaw_rad));
    const double away = along.dot(to_box) / distance;
    // The axis that points away from the sensor more is the depth.
    const bool length_is_depth = std::abs(away) > std::sqrt(0.5);
    OrientedBox box = visible;
    double& depth = length_is_depth ? box.size_m.x() : box.size_m.y();
    const double breadth = length_is_depth ? box.size_m.y() : box.size_m.x();
    const double missing = std::min(0.5 * breadth, kCarWidth_m) - depth;
    if (missing <= 0.0) return box;
    depth += missing;
    const Eigen::Vector2d axis = length_is_depth ? along : Eigen::Vector2d(-along.y(), along.x());
    box.center_m.head<2>() += (axis.dot(to_box) >= 0.0 ? 0.5 : -0.5) * missing * axis;
    return box;
}

}  // namespace dlod
