#include "core/odometry/bootstrap.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "core/odometry/motion_iteration.hpp"

namespace dlod {
namespace {

constexpr int kPasses = 4;
// A robot that stands, or nearly, sees so much of its first scan again.
constexpr double kSameViewShare = 0.85;
// Without IMU, one that seems to have moved farther meanwhile may have moved any other way as well.
constexpr double kNearlyStanding_m = 0.05;
// For the same: surfaces by the direction that they face in the plan, and points of one that make it count; more of
// them where the IMU is at rest, as a few may lie at edges, and face elsewhere in the map.
constexpr std::size_t kViewDirections = 4;
constexpr double kMinViewPoints = 15.0;
constexpr double kMinViewPointsAtRest = 100.0;
// What a robot may be at when it is switched on: velocities to begin with, in eight directions of the horizontal plane.
constexpr double kFirstSpeeds_mps[] = {5.0, 10.0, 15.0};
constexpr int kFirstDirections = 8;
constexpr int kTrialPasses = 2;
constexpr int kTrialIterations = 4;
constexpr double kClearlyBetterFit = 1.02;
// A first scan whose points turn out to be off by more, at that distance, is void.
constexpr double kMaxSkew_m = 0.05;
constexpr double kSkewReach_m = 10.0;

}  // namespace

void Bootstrap::begin(const PlacedScan& scan, const MotionFilter& filter) {
    pending_ = true;
    first_filter_ = filter;
    published_ = filter.state();
    first_points_ = scan.points();
    first_.begin(first_points_, scan.stamp_ns(), static_cast<double>(scan.motion().duration_s));
}

void Bootstrap::align(FrameRegistration& registration, MotionFilter& filter, KeyframeDatabase& map, bool at_rest) {
    const Second second{registration, filter, map};
    const MotionFilter unmoved = first_filter_;
    registration.align(filter, map.submap(), {});
    const bool nearly_stands = filter.uses_imu() || filter.correction().head<3>().norm() < kNearlyStanding_m;
    first_filter_ = nearly_stands && sees_the_same(registration, at_rest ? kMinViewPointsAtRest : kMinViewPoints)
                        ? unmoved
                        : likeliest_start(second);
    begin_again(second);
    settle(second, kPasses, FrameRegistration::kManyIterations);
    registration.align(filter, map.submap(), {});
}

/// The first scan is seen again, as a whole and by its surfaces of every direction: in a street, facades and ground
/// look the same from everywhere, and only the little that faces along it tells a motion.
bool Bootstrap::sees_the_same(const FrameRegistration& registration, double least_points) {
    const PlacedScan& scan = registration.scan();
    // Raw points, as of leaves, find no surface in a map of one scan.
    double flat = 0.0;
    std::array<double, kViewDirections> seen{};
    std::array<double, kViewDirections> again{};
    const auto count = [](std::array<double, kViewDirections>& counts, float nx, float ny) {
        if (nx * nx + ny * ny < 0.5F) return;
        // Both sides of a surface are one direction. The axes lie in the middle of theirs.
        const double half_turns = std::atan2(static_cast<double>(ny), static_cast<double>(nx)) / std::numbers::pi + 2.0;
        ++counts[static_cast<std::size_t>(half_turns * kViewDirections + 0.5) % kViewDirections];
    };
    for (std::size_t i = 0; i < scan.left_out().size(); ++i) {
        if (!scan.takes_part(i) || !scan.points().is_flat(i)) continue;
        flat += 1.0;
        count(seen, scan.placed().nx[i], scan.placed().ny[i]);
    }
    const PlaneMatches& matches = registration.matches();
    double flat_again = 0.0;
    for (std::size_t i = 0; i < matches.flat; ++i) {
        if (!registration.lies_on_plane(i)) continue;
        flat_again += 1.0;
        count(again, matches.h[0][i], matches.h[1][i]);
    }
    if (flat_again < kSameViewShare * flat) return false;
    for (std::size_t k = 0; k < kViewDirections; ++k) {
        if (seen[k] >= least_points && again[k] < kSameViewShare * seen[k]) return false;
    }
    return true;
}

/// The robot may be fast already: beyond a metre or so between two scans, the registration finds the nearest of what
/// looks alike. Of the ways that it finds from several velocities the one counts that explains most of the scan; a
/// faster one has to explain clearly more, and all of them more than what has just been found without any.
MotionFilter Bootstrap::likeliest_start(const Second& second) {
    const MotionFilter unmoved = first_filter_;
    MotionFilter best = unmoved;
    second.registration.match(second.map.submap());
    double best_fit = second.registration.quality().fit;
    const auto try_velocity = [&](const Eigen::Vector3d& velocity_mps) {
        first_filter_ = unmoved;
        first_filter_.forget_velocity();
        first_filter_.set_motion(velocity_mps, unmoved.state().rate_radps);
        begin_again(second);
        settle(second, kTrialPasses, kTrialIterations);
        // One motion has to explain both the way between the scans and the skew of each.
        second.registration.match(second.map.submap());
        if (const double fit = second.registration.quality().fit; fit > kClearlyBetterFit * best_fit) {
            best_fit = fit;
            best = first_filter_;
        }
    };
    try_velocity(unmoved.state().velocity_mps);
    for (const double speed_mps : kFirstSpeeds_mps) {
        for (int direction = 0; direction < kFirstDirections; ++direction) {
            const double heading = 2.0 * std::numbers::pi * direction / kFirstDirections;
            try_velocity(unmoved.state().rotation *
                         Eigen::Vector3d(speed_mps * std::cos(heading), speed_mps * std::sin(heading), 0.0));
        }
    }
    return best;
}

/// Registers the scan and deskews the first one for the motion that this gives, so many times. Where what is to be seen
/// of the motion lies in a part of the sweep, the motion that it gives goes too far.
void Bootstrap::settle(const Second& second, int passes, int iterations_a_pass) {
    const double dt = static_cast<double>(second.registration.scan().stamp_ns() - first_filter_.stamp_ns()) * 1e-9;
    MotionIteration iteration;
    for (int pass = 0; pass < passes; ++pass) {
        second.registration.align(second.filter, second.map.submap(), {.first_stage_iterations = iterations_a_pass});
        if (!second.registration.has_matches()) return;
        const MotionFilter::Vector correction = second.filter.correction();
        const MotionState& first = first_filter_.state();
        Vector6d motion, change;
        motion << first.velocity_mps, first.rate_radps;
        change << correction.segment<3>(0), first.rotation.conjugate() * correction.segment<3>(3);
        change /= dt;
        if (second.filter.uses_imu()) change.tail<3>().setZero();
        motion = iteration.next(motion, change);
        first_filter_.set_motion(motion.head<3>(), motion.tail<3>());
        begin_again(second);
    }
}

/// Back to the first scan, with the motion that is now believed of it; then the prediction for the present one.
void Bootstrap::begin_again(const Second& second) {
    PlacedScan& present = second.registration.scan();
    first_.share_origin(present);
    first_.move_all(first_filter_);
    second.map.set_provisional(first_.cloud());
    second.registration.set_target(first_, first_filter_.T_world_sensor());
    second.filter = first_filter_;
    second.filter.predict(present.stamp_ns());
    present.move(second.filter);
}

std::optional<std::int64_t> Bootstrap::void_scan_ns() const {
    const MotionState& now = first_filter_.state();
    const auto duration_s = static_cast<double>(first_.motion().duration_s);
    const double turn_rad = (now.rate_radps - published_.rate_radps).norm() * duration_s;
    const double way_m = (now.velocity_mps - published_.velocity_mps).norm() * duration_s;
    if (way_m + kSkewReach_m * turn_rad <= kMaxSkew_m) return std::nullopt;
    return first_filter_.stamp_ns();
}

}  // namespace dlod
