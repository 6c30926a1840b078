#include "core/odometry/bootstrap.hpp"

#include <cmath>
#include <numbers>

#include "core/odometry/motion_iteration.hpp"
#include "core/odometry/witnesses.hpp"

namespace dlod {
namespace {

constexpr int kPasses = 4;
// Without IMU, one that seems to have moved farther meanwhile may have moved any other way as well.
constexpr double kNearlyStanding_m = 0.05;
// Points that face one direction of the plan and make it count; more of them where the IMU is at rest, as the search
// for a velocity is long, and a few people are no reason for it.
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
    told_ = true;
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
    const bool stands = nearly_stands && Witnesses(registration.scan(), registration.matches())
                                             .see_the_same(at_rest ? kMinViewPointsAtRest : kMinViewPoints);
    first_filter_ = stands ? unmoved : likeliest_start(second);
    begin_again(second);
    settle(second, kPasses, FrameRegistration::kManyIterations);
    registration.align(filter, map.submap(), {});
    if (at_rest || stands) return;
    PlaneMatches again;
    registration.match(first_, map.submap(), again);
    told_ = Witnesses(registration.scan(), registration.matches()).are_more_than_one_body(Witnesses(first_, again));
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
