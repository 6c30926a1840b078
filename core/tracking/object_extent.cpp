#include "core/tracking/object_extent.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {

namespace {

constexpr double kNotSeen = 10.0;  // standard deviation of what was not measured, m or rad
constexpr double kOblique = 0.35;  // sine of 20 degrees: a side seen flatter than that hides nothing
constexpr double kLimb = 0.25;     // of the difference to the remembered size
constexpr double kCarWidth_m = 1.8;
constexpr double kWidest_m = 3.2;    // vehicles
constexpr double kLimbs_m = 2.0;     // what is smaller may have limbs: a low or narrow piece of it may be one
constexpr double kMostOfIt = 0.5;    // of its height must be seen for its ends to be seen
constexpr double kPieceNoise = 0.8;  // of what it may be off by: an even distribution has 0.58
constexpr double kLongest_m = 25.0;
constexpr double kVehicleLength_m = 4.0;   // of the smaller cars
constexpr double kVehicleWidth_m = 1.4;    // what is as wide as that
constexpr double kVehicleSpeed_mps = 3.0;  // and as fast is neither a person nor two side by side
constexpr double kHeavyLength_m = 9.0;     // lorries and buses are 6 to 12 m long,
constexpr double kHeavyWidth_m = 2.3;      // wider than cars and vans,
constexpr double kHeavyHeight_m = 2.5;     // and taller

/// Which ends of an axis of the box are hidden.
struct HiddenEnds {
    bool low = false, high = false;
};

/// @param across_m size of the box across the axis
HiddenEnds hidden_ends(const Eigen::Vector2d& axis, double across_m, const OrientedBox& box,
                       const Visibility& visibility) {
    const Eigen::Vector2d to_box = (box.center_m - visibility.sensor_m).head<2>();
    const double distance = std::max(1e-6, to_box.norm());
    const double away = axis.dot(to_box) / distance;
    const double left = axis.dot(Eigen::Vector2d(-to_box.y(), to_box.x())) / distance;
    // Of what the sensor stands beside only the near side is seen, at whatever angle.
    const double oblique = std::abs(left) * distance < 0.5 * across_m ? 0.0 : kOblique;
    HiddenEnds hidden;
    hidden.high = away > oblique || (left > kOblique && visibility.occluded_left) ||
                  (left < -kOblique && visibility.occluded_right);
    hidden.low = away < -oblique || (left < -kOblique && visibility.occluded_left) ||
                 (left > kOblique && visibility.occluded_right);
    return hidden;
}

struct CompletedSide {
    double center_m = 0.0;  ///< from the remembered centre, before the growth
    double size_m = 0.0;
    double position_sd_m = 0.0;
    double size_sd_m = 0.0;
    double growth_low_m = 0.0, growth_high_m = 0.0;
};

/// What is wide both ways is not one thing that can move: its shorter side is taken back.
double longest_side(double side_m, double other_side_m) {
    return other_side_m > kWidest_m && side_m <= other_side_m ? kWidest_m : kLongest_m;
}

/// @param center_m of the visible side, from the remembered centre
/// @param most_m it is no longer than that
/// @param piece of something with limbs: it may be one of them
CompletedSide complete_side(double center_m, double visible_m, double before_m, double remembered_m, double most_m,
                            HiddenEnds hidden, bool piece, const KalmanConfig& config) {
    CompletedSide side{center_m, visible_m, config.position_sd_m, config.size_sd_m, 0.0, 0.0};
    if (!hidden.low && !hidden.high) {
        // A limb that is stretched out for a moment is not the object's size: seen ends move it by a little.
        side.position_sd_m += kLimb * std::abs(remembered_m - visible_m);
        return side;
    }
    const double growth = std::min(std::max(remembered_m, std::min(visible_m, before_m)), most_m) - remembered_m;
    side.size_m = remembered_m + growth;
    side.size_sd_m = kNotSeen;
    const double missing = side.size_m - visible_m;
    if (hidden.low && hidden.high && piece && growth <= 0.0) {
        // It lies somewhere inside, the middle as likely as where it was expected: half of the way.
        const double slack = 0.5 * std::max(0.0, missing);
        side.center_m += 0.5 * std::clamp(-center_m, -slack, slack);
        side.position_sd_m += kPieceNoise * slack;
    } else if (hidden.low && hidden.high) {
        // The visible part lies somewhere inside.
        const double slack = 0.5 * std::max(0.0, missing);
        const double toward = growth > 0.0 ? 0.0 : std::clamp(-center_m, -slack, slack);
        side.center_m = center_m + toward;
        const double beyond = std::clamp(center_m / std::max(1e-6, 0.5 * std::abs(growth)), -1.0, 1.0);
        side.growth_high_m = 0.5 * (1.0 + beyond) * growth;
        side.growth_low_m = growth - side.growth_high_m;
        side.position_sd_m += 0.5 * std::abs(missing);
    } else {
        side.center_m += hidden.high ? 0.5 * missing : -0.5 * missing;
        (hidden.high ? side.growth_high_m : side.growth_low_m) = growth;
        side.position_sd_m += missing > 0.0 ? 0.15 * missing : -kLimb * missing;
    }
    return side;
}

}  // namespace

ExtentMeasurement complete_extent(const OrientedBox& visible, const Eigen::Vector3d& before_m,
                                  const OrientedBox& remembered, const Visibility& visibility, bool moves,
                                  const KalmanConfig& config) {
    const Eigen::Vector2d along(std::cos(visible.yaw_rad), std::sin(visible.yaw_rad));
    const Eigen::Vector2d across(-along.y(), along.x());
    const Eigen::Vector2d offset = (visible.center_m - remembered.center_m).head<2>();
    const bool piece =
        moves && remembered.longest_m() < kLimbs_m && visible.size_m.z() < kMostOfIt * remembered.size_m.z();
    const auto ends = [&](const Eigen::Vector2d& axis, double across_m) {
        return piece ? HiddenEnds{true, true} : hidden_ends(axis, across_m, visible, visibility);
    };
    const CompletedSide length = complete_side(
        along.dot(offset), visible.size_m.x(), before_m.x(), remembered.size_m.x(),
        longest_side(remembered.size_m.x(), remembered.size_m.y()), ends(along, visible.size_m.y()), piece, config);
    const CompletedSide width = complete_side(
        across.dot(offset), visible.size_m.y(), before_m.y(), remembered.size_m.y(),
        longest_side(remembered.size_m.y(), remembered.size_m.x()), ends(across, visible.size_m.x()), piece, config);
    ExtentMeasurement out;
    out.growth = {length.growth_high_m, length.growth_low_m, width.growth_high_m, width.growth_low_m};
    BoxMeasurement& m = out.box;
    m.box = visible;
    m.box.center_m.head<2>() = remembered.center_m.head<2>() + length.center_m * along + width.center_m * across;
    m.box.size_m.x() = length.size_m;
    m.box.size_m.y() = width.size_m;
    m.plane_covariance = length.position_sd_m * length.position_sd_m * along * along.transpose() +
                         width.position_sd_m * width.position_sd_m * across * across.transpose();
    // What is lower than an object that moves is some part of it; of what rests, more may be another thing's.
    const double hidden_m = moves ? std::max(0.0, remembered.size_m.z() - visible.size_m.z()) : 0.0;
    const double above_m = visible.center_m.z() - remembered.center_m.z();
    m.box.center_m.z() -= std::clamp(above_m, -0.5 * hidden_m, 0.5 * hidden_m);
    m.z_sd_m = config.position_sd_m + 0.25 * std::abs(remembered.size_m.z() - visible.size_m.z()) + 0.25 * hidden_m;
    m.yaw_sd_rad = kNotSeen;
    m.size_sd_m = Eigen::Vector3d(length.size_sd_m, width.size_sd_m, config.size_sd_m + hidden_m);
    // So is what is seen: merged with something else, it says little of the object.
    const double excess = visible.size_m.head<2>().minCoeff() - kWidest_m;
    if (excess > 0.0) {
        m.plane_covariance += (1.0 + excess * excess) * Eigen::Matrix2d::Identity();
        m.size_sd_m.head<2>().setConstant(kNotSeen);
    }
    return out;
}

Growth assumed_growth(const OrientedBox& box, const Eigen::Vector3d& visible_m, double speed_mps,
                      const Visibility& visibility) {
    const Eigen::Vector2d along(std::cos(box.yaw_rad), std::sin(box.yaw_rad));
    const Eigen::Vector2d across(-along.y(), along.x());
    const double length = box.size_m.x(), width = box.size_m.y();
    const double seen_width = std::min(width, visible_m.y());
    const bool vehicle = speed_mps > kVehicleSpeed_mps && seen_width > kVehicleWidth_m;
    // Where its side is seen, that tells its length.
    const bool heavy = vehicle && seen_width > kHeavyWidth_m && box.size_m.z() > kHeavyHeight_m &&
                       visible_m.x() < 0.5 * kHeavyLength_m;
    const double least_length = heavy     ? kHeavyLength_m
                                : vehicle ? kVehicleLength_m
                                          : std::min(0.5 * width, kCarWidth_m);
    const double missing_length = least_length - length;
    const double missing_width = std::min(0.5 * length, kCarWidth_m) - width;
    Growth growth;
    if (missing_length > 0.0) {
        const HiddenEnds ends = hidden_ends(along, width, box, visibility);
        if (ends.high != ends.low) (ends.high ? growth.front : growth.back) = missing_length;
    }
    if (missing_width > 0.0) {
        const HiddenEnds ends = hidden_ends(across, length, box, visibility);
        if (ends.high != ends.low) (ends.high ? growth.left : growth.right) = missing_width;
    }
    return growth;
}

Growth surplus(const OrientedBox& remembered, const OrientedBox& part) {
    const Eigen::Vector2d along(std::cos(remembered.yaw_rad), std::sin(remembered.yaw_rad));
    const Eigen::Vector2d across(-along.y(), along.x());
    const Eigen::Vector2d offset = (part.center_m - remembered.center_m).head<2>();
    const auto beyond = [](double at, double part_m, double remembered_m) {
        return std::min(0.0, at + 0.5 * (part_m - remembered_m));
    };
    const double length = remembered.size_m.x(), width = remembered.size_m.y();
    return {beyond(along.dot(offset), part.size_m.x(), length), beyond(-along.dot(offset), part.size_m.x(), length),
            beyond(across.dot(offset), part.size_m.y(), width), beyond(-across.dot(offset), part.size_m.y(), width)};
}

Growth enclosing_growth(const OrientedBox& remembered, const OrientedBox& part) {
    const double turn = part.yaw_rad - remembered.yaw_rad;
    const double c = std::abs(std::cos(turn)), s = std::abs(std::sin(turn));
    const Eigen::Vector2d along(std::cos(remembered.yaw_rad), std::sin(remembered.yaw_rad));
    const Eigen::Vector2d offset = (part.center_m - remembered.center_m).head<2>();
    const double u = along.dot(offset), v = along.x() * offset.y() - along.y() * offset.x();
    const double room_u = 0.5 * (remembered.size_m.x() - c * part.size_m.x() - s * part.size_m.y());
    const double room_v = 0.5 * (remembered.size_m.y() - s * part.size_m.x() - c * part.size_m.y());
    return {std::max(0.0, u - room_u), std::max(0.0, -u - room_u), std::max(0.0, v - room_v),
            std::max(0.0, -v - room_v)};
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
