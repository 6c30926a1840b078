#include "core/tracking/vehicle_parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/tracking/bounding_box.hpp"
#include "core/tracking/box_iou.hpp"

namespace dlod {

namespace {

constexpr int kKnownHits = 5;           // an extent that can be relied upon
constexpr double kRestSize = 1.2;       // the rest of an object is at most so many times as large as it was
constexpr double kSameVehicle_m = 0.3;  // a vehicle's parts together are no larger than that beyond what is known
constexpr double kMargin_m = 0.4;       // of a piece's place in a vehicle's box
constexpr double kInside = 0.6;         // of its footprint lies in there
constexpr double kSameVelocity_mps = 1.0;

// Cars and vans.
constexpr double kLongest_m = 5.5;
constexpr double kShortest_m = 2.5;
constexpr double kWidest_m = 2.7;
constexpr double kNarrowest_m = 1.2;
constexpr double kLowest_m = 1.0;
constexpr double kFrontWidth = 0.6;  // of the width of the whole
constexpr double kAtTheEnd = 0.2;    // of its length from the middle

constexpr int kPieceHits = 3;
constexpr double kSameSpeed = 0.15;         // up to that share
constexpr double kKnownVelocity_mps = 1.5;  // standard deviation
constexpr double kDriving_mps = 3.0;        // faster than people walk
constexpr double kRunning_mps = 7.0;        // faster than people run
constexpr double kLonger_m = 2.0;           // than people and cyclists
constexpr double kMoving_mps = 1.5;
constexpr double kBumperHeight_m = 1.0;
constexpr double kFront_m = 0.8;
constexpr double kBehind_m = 1.0;  // what is farther than both pieces is seen between them
constexpr int kPlaces = 5;
constexpr double kAbove_m = 0.8;      // one piece is no more above another
constexpr double kBody_m = 1.2;       // people are no broader,
constexpr double kTall_m = 0.8;       // and no lower,
constexpr double kCyclist_m = 1.8;    // cyclists no longer,
constexpr double kUpright = 1.25;     // nor than so many times their height
constexpr double kReflected_m = 1.5;  // what glass shows seems to be that much beyond the vehicle's end at most
constexpr double kFringe = 0.01;      // of tangents: edges are seen within a beam or two

/// Bumper and windscreen: both wider than people, the lower one lower, too.
bool are_front(const OrientedBox& a, const OrientedBox& b, const Eigen::Vector2d& across) {
    const OrientedBox& lower = a.center_m.z() < b.center_m.z() ? a : b;
    return lower.size_m.z() < kBumperHeight_m && std::min(width_along(a, across), width_along(b, across)) > kFront_m;
}

/// What a sensor sees of a detection: its sides and its upper and lower edge, as tangents about a direction.
struct Outline {
    Outline(const PointSpan& points, const Eigen::Vector3d& origin_m, const Eigen::Vector3d& sensor_m,
            const Eigen::Vector2d& ahead) {
        const Eigen::Vector3f offset = (origin_m - sensor_m).cast<float>();
        const auto c = static_cast<float>(ahead.x()), s = static_cast<float>(ahead.y());
        for (std::size_t i = 0; i < points.size(); ++i) {
            const float x = points.x[i] + offset.x(), y = points.y[i] + offset.y(), z = points.z[i] + offset.z();
            const float depth = c * x + s * y;
            if (depth <= 0.0F) continue;
            const Eigen::Vector2f at((c * y - s * x) / depth, z / std::hypot(x, y));
            low = low.cwiseMin(at);
            high = high.cwiseMax(at);
        }
    }
    bool encloses(const Outline& other) const {
        return (other.low.array() > low.array() - static_cast<float>(kFringe)).all() &&
               (other.high.array() < high.array() + static_cast<float>(kFringe)).all();
    }

    Eigen::Vector2f low = Eigen::Vector2f::Constant(std::numeric_limits<float>::max());
    Eigen::Vector2f high = Eigen::Vector2f::Constant(std::numeric_limits<float>::lowest());
};

/// Whether `inner` is seen within the outline of a vehicle that is nearer.
bool seen_through(const Detection& vehicle, const Detection& inner, const DetectionShapes& shapes,
                  const Eigen::Vector3d& sensor_m) {
    const Eigen::Vector2d ahead = (vehicle.centroid_m - sensor_m).head<2>();
    if ((inner.centroid_m - sensor_m).head<2>().squaredNorm() < ahead.squaredNorm()) return false;
    const auto outline = [&](const Detection& d) {
        return Outline(shapes.points(d), shapes.origin(), sensor_m, ahead.normalized());
    };
    return outline(vehicle).encloses(outline(inner));
}

/// Whether the ground, or something farther than both, is seen between two detections.
bool gap_between(const Detection& a, const Detection& b, const Frame& frame, const SweepProjection& projection) {
    const Eigen::Vector3d sensor = frame.odometry.T_world_sensor.translation();
    const double farther = std::max((a.centroid_m - sensor).norm(), (b.centroid_m - sensor).norm()) + kBehind_m;
    int behind = 0;
    for (int k = 1; k <= kPlaces; ++k) {
        const double share = static_cast<double>(k) / (kPlaces + 1);
        const auto seen = projection.project((1.0 - share) * a.centroid_m + share * b.centroid_m);
        if (!seen) continue;
        const auto [row, column] = seen->pixel;
        if (frame.cloud.range_m(row, column) > farther || frame.prepared.ground(row, column) != 0) ++behind;
    }
    return 2 * behind > kPlaces;
}

}  // namespace

bool is_rest_of(const TrackedObject& host, const Detection& front, const Detection& rest) {
    const OrientedBox box = host.box();
    return host.state() == DynamicState::kDynamic && host.hits() >= kKnownHits &&
           joint_size(front.box, rest.box, box.yaw_rad).maxCoeff() < kRestSize * box.longest_m() &&
           rest.box.size_m.z() < kRestSize * box.size_m.z();
}

bool sets_off_with(const TrackedObject& host, const Detection& seen, const Detection& part) {
    if (!host.sets_off()) return false;
    const OrientedBox box = host.box();
    const Eigen::Vector2d joint_m = joint_size(seen.box, part.box, box.yaw_rad);
    return (joint_m.array() < box.size_m.head<2>().array() + kSameVehicle_m).all() &&
           part.box.size_m.z() < box.size_m.z() + kSameVehicle_m;
}

bool is_at_front_of(const Detection& rest, const Detection& front) {
    const OrientedBox& box = rest.box;
    if (rest.count < front.count || box.size_m.z() < kLowest_m) return false;
    const bool along_x = box.size_m.x() >= box.size_m.y();
    const double yaw = box.yaw_rad + (along_x ? 0.0 : 0.5 * std::numbers::pi);
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw)), across(-along.y(), along.x());
    const Eigen::Vector2d joint_m = joint_size(box, front.box, yaw);
    const bool vehicle =
        joint_m.x() > kShortest_m && joint_m.x() < kLongest_m && joint_m.y() > kNarrowest_m && joint_m.y() < kWidest_m;
    return vehicle && width_along(front.box, across) > std::max(kNarrowest_m, kFrontWidth * joint_m.y()) &&
           std::abs(along.dot((front.box.center_m - box.center_m).head<2>())) > kAtTheEnd * joint_m.x();
}

bool is_front_of(const TrackedObject& rest, const TrackedObject& front) {
    if (front.state() != DynamicState::kDynamic || front.is_body()) return false;
    // What is known as a whole vehicle is no front of another one.
    const OrientedBox box = front.box();
    if (box.longest_m() > kShortest_m &&
        joint_size(box, rest.box(), box.yaw_rad).maxCoeff() > kRestSize * box.longest_m())
        return false;
    const double differs = (rest.velocity() - front.velocity()).head<2>().norm();
    return differs < kSameVelocity_mps + 2.0 * rest.velocity_sd() + std::min(kKnownVelocity_mps, front.velocity_sd());
}

bool one_vehicle(const TrackedObject& whole, const TrackedObject& piece) {
    // Who walks by himself, and has been known for longer, stands beside it.
    if (!whole.drives() || (piece.is_body() && piece.goes_before(whole))) return false;
    const double differs = (whole.velocity() - piece.velocity()).head<2>().norm();
    const double tolerance = kSameVelocity_mps + 2.0 * (whole.velocity_sd() + piece.velocity_sd());
    return differs < tolerance && share_inside(piece.box(), whole.box(), kMargin_m) > kInside &&
           piece.box().size_m.head<2>().norm() < whole.box().size_m.head<2>().norm();
}

bool pieces_of_one_vehicle(const TrackedObject& a, const Detection& seen_a, const TrackedObject& b,
                           const Detection& seen_b, const Frame& frame, const DetectionShapes& shapes,
                           const SweepProjection& projection) {
    const Eigen::Vector2d between = (seen_b.box.center_m - seen_a.box.center_m).head<2>();
    if (between.squaredNorm() > kLongest_m * kLongest_m || !a.under_way() || !b.under_way()) return false;
    const double sd = std::max(a.velocity_sd(), b.velocity_sd());
    if (std::min(a.hits(), b.hits()) < kPieceHits || sd > kKnownVelocity_mps) return false;
    const Eigen::Vector2d va = a.velocity().head<2>(), vb = b.velocity().head<2>();
    const double speed = (0.5 * (va + vb)).norm();
    if (speed < std::max(kMoving_mps, 2.0 * sd)) return false;
    const double differs = std::hypot(kSameSpeed * speed, a.velocity_sd(), b.velocity_sd());
    if ((va - vb).norm() > differs) return false;
    // Boxes along the axes of what is seen of each would reach farther than the pieces do.
    const double yaw = std::atan2(va.y() + vb.y(), va.x() + vb.x());
    const auto along_velocity = [&](const Detection& d) { return box_at_yaw(shapes.points(d), shapes.origin(), yaw); };
    const OrientedBox box_a = along_velocity(seen_a), box_b = along_velocity(seen_b);
    const Eigen::Vector2d joint_m = joint_size(box_a, box_b, yaw);
    if (joint_m.y() > kWidest_m) return false;
    const Eigen::Vector3d sensor = frame.odometry.T_world_sensor.translation();
    const auto interior = [&](const TrackedObject& vehicle, const Detection& seen, const OrientedBox& box,
                              const Detection& inner) {
        return vehicle.drives() && box.size_m.y() > kNarrowest_m && joint_m.x() < kLongest_m + kReflected_m &&
               seen_through(seen, inner, shapes, sensor);
    };
    if (interior(a, seen_a, box_a, seen_b) || interior(b, seen_b, box_b, seen_a)) return true;
    if (joint_m.x() > kLongest_m) return false;
    const bool larger = std::max(a.box().longest_m(), b.box().longest_m()) > kLonger_m;
    const Eigen::Vector2d across(-std::sin(yaw), std::cos(yaw));
    if (speed < (larger ? kDriving_mps : kRunning_mps) && !are_front(a.box(), b.box(), across)) return false;
    return !gap_between(seen_a, seen_b, frame, projection);
}

bool may_be_one_vehicle(const Detection& a, const Detection& b, const Frame& frame, const SweepProjection& projection) {
    const Eigen::Vector2d between = (b.box.center_m - a.box.center_m).head<2>();
    if (between.squaredNorm() > kLongest_m * kLongest_m || height_gap_m(a.box, b.box) > kAbove_m) return false;
    const auto upright = [](const OrientedBox& box) {
        return box.size_m.z() > kTall_m && box.longest_m() < std::min(kCyclist_m, kUpright * box.size_m.z());
    };
    if (upright(a.box) || upright(b.box)) return false;
    const Eigen::Vector2d joint_m = joint_size(a.box, b.box, std::atan2(between.y(), between.x()));
    return joint_m.x() > kBody_m && joint_m.x() < kLongest_m && joint_m.y() < kWidest_m &&
           !gap_between(a, b, frame, projection);
}

}  // namespace dlod
