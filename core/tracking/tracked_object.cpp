#include "core/tracking/tracked_object.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/tracking/bounding_box.hpp"
#include "core/tracking/rectangle_fit.hpp"
#include "core/tracking/visible_shift.hpp"

namespace dlod {

namespace {

constexpr int kYoungHits = 3;              // detections before a velocity means something
constexpr int kEstablishedHits = 5;        // detections before its prediction is worth something
constexpr int kBlindFrames = 2;            // a prediction is published where nothing is seen
constexpr double kVague_m = 0.3;           // and none that is less sure: half of a person
constexpr double kHeadingSpeed_mps = 0.7;  // slower objects may move sideways
constexpr double kElongated = 1.6;         // a principal axis says where an object points
constexpr double kDoubt_m = 0.5;           // in the size of what may have been two
constexpr double kBody_m = 1.0;            // people and the like seem no larger
constexpr double kRunning_mps = 3.0;       // what is faster may be a vehicle of which little is seen
constexpr double kTwoBodies_m = 1.5;       // and are none if they were that long
constexpr double kCutSize_m = 2.0;         // noise of the size of what was cut out by its own box
constexpr double kVehicle_m = 2.5;         // vehicles are longer than people and cyclists
constexpr double kDriving_mps = 1.0;
constexpr double kLong_m = 1.5;        // sides of that length say it better
constexpr int kSidesFrames = 5;        // between two looks at them where an object rests
constexpr double kMostSlip_rad = 0.6;  // between an object's heading and its sides
constexpr double kAgreeing_m = 0.3;    // a shorter displacement may be noise
constexpr double kAgreement = 0.4;     // of its length, from what the velocity predicts
constexpr int kAgreeingFrames = 4;
constexpr double kGross_m = 1.0;         // nothing that rests seems to move that far
constexpr int kTrustedFrames = 2;        // until the registered velocity of a large object is one
constexpr double kLarge_m = 1.6;         // footprint diagonal
constexpr double kEnters = 0.05;         // of the points, in free space, of what sets off for the first time
constexpr double kStale_s = 2.0;         // older ones show another side
constexpr double kSureSpeed = 3.0;       // standard deviations
constexpr double kSlow_mps = 0.3;        // of what moves
constexpr double kSettingOff_mps = 0.8;  // of what has set off, once it stands where it did not before
constexpr double kReference_s = 0.45;    // points to register to are renewed that often
constexpr double kReference_m = 1.0;     // and after such a way: a fast object soon shows another side

const DetectionShape& largest_shape(const DetectionShapes& shapes, const Sighting& sighting) {
    return shapes[sighting.detections.front()];
}

BoxMeasurement first_measurement(const DetectionShapes& shapes, const Sighting& sighting, const OrientedBox& visible,
                                 const KalmanConfig& config) {
    BoxMeasurement m = complete_extent(visible, visible.size_m, assumed_box(visible, sighting.visibility),
                                       sighting.visibility, false, config)
                           .box;
    const DetectionShape& shape = largest_shape(shapes, sighting);
    m.age_s = shape.age_s;
    m.yaw_sd_rad = shape.axis.elongation > kElongated ? 0.2 : 1.0;
    m.size_sd_m = m.size_sd_m.cwiseMin(0.5);
    return m;
}

/// What the free space and the residuals say of all its parts together. Of small segments all is tested, of large ones
/// samples: each counts by its pixels.
MotionCues evidence_of(const DetectionResult& result, const Sighting& sighting) {
    MotionCues cues;
    double residual_sum = 0.0;
    double pixels = 0.0, tested = 0.0, free = 0.0, occupied = 0.0, unknown = 0.0;
    const auto tested_of = [](const Detection& d) { return d.free_points + d.occupied_points + d.unknown_points; };
    for (std::size_t d : sighting.detections) {
        const Detection& part = result.detections[d];
        residual_sum += part.average_residual_m * part.residual_points;
        cues.residual_points += part.residual_points;
        int of_segment = 0;
        double pixels_of_segment = 0.0;
        for (std::size_t other : sighting.detections) {
            if (result.detections[other].segment != part.segment) continue;
            of_segment += tested_of(result.detections[other]);
            pixels_of_segment += result.detections[other].count;
        }
        const double weight = pixels_of_segment / std::max(1, of_segment);
        free += weight * part.free_points;
        occupied += weight * (part.occupied_points - part.edge_points);
        unknown += weight * (part.unknown_points + part.edge_points);
        tested += tested_of(part);
        pixels += part.count;
        cues.turned = cues.turned || part.turned;
    }
    const auto of_tested = [&](double n) { return static_cast<int>(std::lround(n * tested / std::max(1.0, pixels))); };
    cues.free_points = of_tested(free);
    cues.occupied_points = of_tested(occupied);
    cues.unknown_points = of_tested(unknown);
    cues.average_residual_m = cues.residual_points > 0 ? residual_sum / cues.residual_points : 0.0;
    return cues;
}

}  // namespace

OrientedBox TrackedObject::visible_box(const Frame& frame, const DetectionShapes& shapes, const Sighting& sighting,
                                       double yaw_rad) {
    const auto box_of = [&](std::size_t d) {
        return box_at_yaw(shapes.points(frame.detection.detections[d]), shapes.origin(), yaw_rad);
    };
    OrientedBox all = box_of(sighting.detections.front());
    const Eigen::Matrix3d R = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    for (std::size_t d : sighting.detections.subspan(1, sighting.shape_parts - 1)) {
        const OrientedBox part = box_of(d);
        const Eigen::Vector3d offset = R.transpose() * (part.center_m - all.center_m);
        const Eigen::Vector3d low = (-0.5 * all.size_m).cwiseMin(offset - 0.5 * part.size_m);
        const Eigen::Vector3d high = (0.5 * all.size_m).cwiseMax(offset + 0.5 * part.size_m);
        all.center_m += R * (0.5 * (low + high));
        all.size_m = high - low;
    }
    return all;
}

TrackedObject::TrackedObject(std::uint32_t id, const Frame& frame, const DetectionShapes& shapes,
                             const Sighting& sighting, const TrackingConfig& config)
    : id_(id),
      visible_(visible_box(frame, shapes, sighting, largest_shape(shapes, sighting).axis.yaw_rad)),
      filter_(first_measurement(shapes, sighting, visible_, config.filter), config.filter),
      first_visible_(visible_),
      born_apart_(sighting.apart) {
    std::vector<OrientedBox> nothing_to_clear;
    see(frame, shapes, sighting, config, nothing_to_clear);
}

void TrackedObject::predict(double dt_s, const TrackingConfig& config) {
    filter_.predict(dt_s, config.filter);
    unseen_s_ += dt_s;
    lifetime_s_ += dt_s;
    before_.age_s += dt_s;
    since_.age_s += dt_s;
    seen_now_ = false;
    ++age_;
}

std::pair<double, double> TrackedObject::measured_yaw(const PointSpan& points) {
    const Eigen::Vector3d velocity = filter_.velocity();
    const double speed = filter_.speed();
    const double sd = filter_.velocity_sd();
    const bool heads = speed > kHeadingSpeed_mps && speed > 2.0 * sd;
    const double heading = heads ? std::atan2(velocity.y(), velocity.x()) : filter_.box().yaw_rad;
    if (heads) filter_.align_axes(heading);
    // The sides of a long object are known better than its heading; those of a thing at rest do not turn.
    const bool rests = belief_.state() == DynamicState::kStatic && age_ % kSidesFrames != 0;
    if (!rests && std::max(filter_.box().longest_m(), visible_.longest_m()) > kLong_m) {
        if (const auto sides = rectangle_yaw(points)) {
            const double turn = std::remainder(*sides - heading, 0.5 * std::numbers::pi);
            if (!heads || std::abs(turn) < kMostSlip_rad) return {wrap_angle(heading + turn), 0.1};
        }
    }
    if (heads) return {heading, std::max(0.1, sd / speed)};
    return {heading, 10.0};
}

void TrackedObject::assume_extent(const Visibility& visibility) {
    if (belief_.state() != DynamicState::kDynamic || hits_ < kEstablishedHits) return;
    const bool heads_along = filter_.speed() > 4.0 * filter_.velocity_sd();
    const Growth growth =
        assumed_growth(filter_.box(), visible_.size_m, heads_along ? filter_.speed() : 0.0, visibility);
    filter_.grow(growth.front, growth.back, growth.left, growth.right);
}

void TrackedObject::see(const Frame& frame, const DetectionShapes& shapes, const Sighting& sighting,
                        const TrackingConfig& config, std::vector<OrientedBox>& cleared) {
    const DetectionShape& shape = largest_shape(shapes, sighting);
    if (hits_ > 0) {
        const auto [yaw, yaw_sd] = measured_yaw(shapes.points(frame.detection.detections[sighting.detections.front()]));
        OrientedBox remembered = filter_.box();
        Eigen::Vector3d before_m = visible_.size_m;
        if (sighting.cut) {
            before_m.y() = 0.0;
            if (remembered.size_m.x() < kVehicle_m) before_m.x() = 0.0;
        }
        visible_ = visible_box(frame, shapes, sighting, remembered.yaw_rad);
        if (sighting.apart) {
            const Growth other = surplus(remembered, assumed_box(visible_, sighting.visibility));
            filter_.grow(other.front, other.back, other.left, other.right);
            filter_.doubt_size(kDoubt_m);
            remembered = filter_.box();
            before_m = visible_.size_m;
        }
        auto [growth, m] = complete_extent(visible_, before_m, remembered, sighting.visibility,
                                           belief_.state() == DynamicState::kDynamic, config.filter);
        filter_.grow(growth.front, growth.back, growth.left, growth.right);
        m.age_s = shape.age_s;
        m.box.yaw_rad = yaw;
        m.yaw_sd_rad = yaw_sd;
        if (sighting.cut) m.size_sd_m.setConstant(kCutSize_m);
        filter_.update(m, config.filter);
        assume_extent(sighting.visibility);
    }
    has_moved_ = has_moved_ || (belief_.state() == DynamicState::kDynamic && filter_.speed() > kHeadingSpeed_mps &&
                                filter_.speed() > kSureSpeed * filter_.velocity_sd());
    const double shift_m = visible_shift_m(first_visible_, visible_);
    const bool whole = sighting.detections.size() == 1 && !sighting.cut && !sighting.apart &&
                       !sighting.visibility.occluded_left && !sighting.visibility.occluded_right;
    const bool walked =
        walked_way_.update({visible_, sighting.visibility.sensor_m.head<2>(), lifetime_s_ - shape.age_s}, whole,
                           filter_.velocity().head<2>());
    // At the stamp, as the filter's centre.
    visible_.center_m += shape.age_s * filter_.velocity() - filter_.box().center_m;

    MotionCues cues = evidence_of(frame.detection, sighting);
    points_ = 0;
    for (std::size_t d : sighting.detections) points_ += static_cast<int>(frame.detection.detections[d].count);
    cues.height_m = visible_.size_m.z();
    // Against what was mapped a moment ago a walker's residual has not come to the threshold yet; a vehicle's has.
    cues.residual_would_show = hits_ + 1 >= config.state.n_min || visible_.longest_m() > kTwoBodies_m;
    cues.shift_m = shift_m;
    cues.dt_s = unseen_s_;
    cues.position_m = filter_.box().center_m.head<2>();
    cues.longest_m = filter_.box().longest_m();
    if (config.state.use_displacement && (watched_at_rest() || !clear_without_displacement(cues)))
        displacement_cue(frame, sighting, shape.age_s, config.state, cues);
    if (config.state.use_displacement && walked) cues.take_walked_way();

    ++hits_;
    misses_ = 0;
    unseen_frames_ = 0;
    unseen_s_ = 0.0;
    seen_now_ = true;
    residual_m_ = cues.average_residual_m;
    const bool moved = belief_.state() == DynamicState::kDynamic;
    if (belief_.update(cues, config.state)) {
        was_dynamic_ = true;
        history_.release(cleared);
        cleared.push_back(filter_.box());
        leave_background(sighting.visibility);
    } else if (belief_.state() != DynamicState::kDynamic) {
        OrientedBox world = visible_;
        world.center_m += filter_.box().center_m;
        history_.add(world);
        if (moved && belief_.rested()) come_to_rest();
    }
}

bool TrackedObject::goes_before(const TrackedObject& other) const {
    return was_dynamic_ != other.was_dynamic_ ? was_dynamic_ : hits_ > other.hits_;
}

void TrackedObject::take_past(TrackedObject& other, std::vector<OrientedBox>& cleared) {
    if (belief_.state() == DynamicState::kDynamic) other.history_.release(cleared);
}

void TrackedObject::join(const OrientedBox& part) {
    const Growth growth = enclosing_growth(filter_.box(), part);
    filter_.grow(growth.front, growth.back, growth.left, growth.right);
}

void TrackedObject::leave_background(const Visibility& visibility) {
    OrientedBox part = visible_;
    part.center_m += filter_.box().center_m;
    const double longest_m = part.longest_m();
    const bool body = longest_m < kBody_m && longest_m < part.size_m.z() && filter_.speed() < kRunning_mps;
    if (!body || filter_.box().longest_m() < kTwoBodies_m) return;
    const Growth other = surplus(filter_.box(), assumed_box(part, visibility));
    filter_.grow(other.front, other.back, other.left, other.right);
}

void TrackedObject::miss(Sight sight) {
    sight_ = sight;
    misses_ += sight == Sight::kNearer ? 0 : sight == Sight::kFarther ? 2 : 1;
    ++unseen_frames_;
}

bool TrackedObject::visible_to_others() const {
    if (seen_now_) return true;
    if (belief_.state() != DynamicState::kDynamic || hits_ < kEstablishedHits || unseen_frames_ > hits_) return false;
    if (filter_.position_sd() > kVague_m) return false;
    return sight_ == Sight::kNearer || sight_ == Sight::kThere ||
           (sight_ == Sight::kUnknown && unseen_frames_ <= kBlindFrames);
}

bool TrackedObject::dead(const TrackingConfig& config) const {
    const bool established =
        hits_ >= kEstablishedHits && (belief_.state() == DynamicState::kDynamic || hits_ > config.max_misses);
    if (unseen_frames_ > (established ? config.max_misses_occluded : config.max_misses)) return true;
    return misses_ > (established ? config.max_misses : config.max_misses_undecided);
}

void TrackedObject::come_to_rest() {
    set_off_.rest();
    before_.age_s = since_.age_s = 2.0 * kStale_s;
}

bool TrackedObject::rests_awhile() const {
    return belief_.known_to_move() && hits_ > 0 && (belief_.state() == DynamicState::kStatic || belief_.has_set_off());
}

bool TrackedObject::watched_at_rest() const {
    if (rests_awhile()) return true;
    return belief_.state() == DynamicState::kStatic &&
           (set_off_.suspected() || (since_.age_s > kReference_s && is_body()));
}

bool TrackedObject::clear_without_displacement(const MotionCues& cues) const {
    const double share = free_share(cues);
    if (share < 0.0 || hits_ == 0 || agreeing_ > 0) return false;
    if (drives()) return false;  // its velocity is measured that way
    if (filter_.speed() > kHeadingSpeed_mps && filter_.speed() > 2.0 * filter_.velocity_sd())
        return belief_.state() == DynamicState::kDynamic && share > 0.3;
    if (belief_.state() == DynamicState::kDynamic) return share > 0.3 && belief_.known_to_move();
    return belief_.state() == DynamicState::kStatic && share < 0.05;
}

void TrackedObject::displacement_cue(const Frame& frame, const Sighting& sighting, double age_s,
                                     const DynamicStateConfig& config, MotionCues& cues) {
    PointSample now;
    const Detection& part = frame.detection.detections[sighting.detections.front()];
    sample_points(frame, std::span(frame.detection.pixels).subspan(part.first, part.count), now);
    now.age_s = age_s;
    const Eigen::Vector2d center = filter_.box().center_m.head<2>();
    if (hits_ == 0) {
        before_ = since_ = now;
        before_center_m_ = since_center_m_ = center;
    } else if (before_.age_s > kStale_s) {
        // It was not asked for a while: begin anew.
        before_ = since_ = now;
        before_center_m_ = since_center_m_ = center;
    } else {
        // Between the firings, not the stamps: what moves sideways is met sooner or later by the turning beams.
        const double elapsed_s = before_.age_s - now.age_s;
        const auto r = register_displacement(before_, now, center - before_center_m_);
        cues.displacement_log_odds = displacement_log_odds(r, elapsed_s);
        const bool decided = belief_.state() == DynamicState::kStatic;
        // Of somebody who stands there some part moves now and then, before he walks on.
        const bool somebody = filter_.box().longest_m() < kTwoBodies_m && filter_.box().size_m.z() > kBody_m;
        cues.stands = !has_moved_ && !somebody &&
                      stands(r, elapsed_s, decided ? kSettingOff_mps : kSlow_mps, (center - before_center_m_).norm());
        if (sighting.visibility.through_gap() && cues.free_points == 0)
            cues.displacement_log_odds = std::min(cues.displacement_log_odds, 0.0);
        // Of what has never moved all has to speak for it: a wall seen through an opening seems to be displaced.
        const bool rests = rests_awhile() || (belief_.state() == DynamicState::kStatic && is_body());
        const MotionCues free_space = config.use_free_space ? cues : MotionCues();
        cues.set_off = rests && set_off_.update(r, free_space) &&
                       (belief_.known_to_move() || (show_same_side(before_, now, center) && set_off_.left_its_place() &&
                                                    free_share(free_space) > kEnters));
        const double length_m = r.displacement_m.norm();
        const auto agrees_with = [&](const Eigen::Vector2d& velocity_mps) {
            return (r.displacement_m - elapsed_s * velocity_mps).norm() < kAgreement * length_m;
        };
        const bool clear = cues.displacement_log_odds > 0.0 && length_m > kAgreeing_m;
        const bool agrees =
            clear && (agrees_with(filter_.velocity().head<2>()) || agrees_with(registered_velocity_mps_));
        agreeing_ = agrees ? agreeing_ + 1 : 0;
        cues.sustained_displacement = agreeing_ >= kAgreeingFrames;
        cues.left_its_place = cues.sustained_displacement && length_m > kGross_m;
        registered_velocity_mps_.setZero();
        if (clear) registered_velocity_mps_ = r.displacement_m / elapsed_s;
        // The middle of what is seen of a large object is no measure of its motion; its own points are.
        if (agreeing_ >= kTrustedFrames && filter_.box().size_m.head<2>().norm() > kLarge_m)
            filter_.update_velocity(registered_velocity_mps_, velocity_covariance(r, elapsed_s));
    }
    const bool sets_off = belief_.known_to_move() && belief_.state() == DynamicState::kStatic && set_off_.suspected();
    if (!sets_off && (since_.age_s > kReference_s || (center - since_center_m_).norm() > kReference_m)) {
        before_ = since_;
        before_center_m_ = since_center_m_;
        since_ = now;
        since_center_m_ = center;
    }
}

bool TrackedObject::is_body() const {
    const Eigen::Vector3d size = filter_.box().size_m;
    return hits_ >= kEstablishedHits && size.head<2>().maxCoeff() < std::min(kTwoBodies_m, size.z());
}

bool TrackedObject::under_way() const {
    return belief_.state() == DynamicState::kDynamic && filter_.speed() > kDriving_mps &&
           filter_.speed() > 2.0 * filter_.velocity_sd();
}

bool TrackedObject::drives() const {
    return under_way() && is_moving_vehicle();
}

bool TrackedObject::is_moving_vehicle() const {
    return belief_.state() == DynamicState::kDynamic && has_moved_ && filter_.box().longest_m() > kVehicle_m;
}

bool TrackedObject::sets_off() const {
    return belief_.state() == DynamicState::kStatic && hits_ >= kEstablishedHits &&
           filter_.box().longest_m() > kVehicle_m && filter_.speed() > 2.0 * filter_.velocity_sd();
}

ExpectedTrack TrackedObject::expected() const {
    ExpectedTrack e;
    e.visible = visible_;
    e.visible.center_m += filter_.box().center_m;
    e.whole = filter_.box();
    e.filter = &filter_;
    e.points = points_;
    e.young = hits_ < kYoungHits;
    e.steady = steady();
    e.established = hits_ >= kEstablishedHits;
    e.dt_s = unseen_s_;
    e.motion = std::clamp(belief_.log_odds() / 3.0, -1.0, 1.0);
    return e;
}

Track TrackedObject::published() const {
    Track t;
    t.id = id_;
    t.state = belief_.state();
    t.box = filter_.box();
    t.velocity_mps = filter_.velocity();
    t.covariance = filter_.motion_covariance();
    t.points = seen_now_ ? points_ : 0;
    t.hits = hits_;
    t.misses = unseen_frames_;
    t.age = age_;
    t.residual_m = residual_m_;
    return t;
}

}  // namespace dlod
