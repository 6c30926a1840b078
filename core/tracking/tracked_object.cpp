#include "core/tracking/tracked_object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/tracking/bounding_box.hpp"

namespace dlod {

namespace {

constexpr int kYoungHits = 3;              // detections before a velocity means something
constexpr int kEstablishedHits = 5;        // detections before its prediction is worth something
constexpr int kBlindFrames = 2;            // a prediction is published where nothing is seen
constexpr double kHeadingSpeed_mps = 0.7;  // slower objects may move sideways
constexpr double kElongated = 1.6;         // a principal axis says where an object points
constexpr double kAgreeing_m = 0.3;        // a shorter displacement may be noise
constexpr double kAgreement = 0.4;         // of its length, from what the velocity predicts
constexpr int kAgreeingFrames = 4;
constexpr double kStale_s = 2.0;       // older ones show another side
constexpr double kReference_s = 0.45;  // points to register to are renewed that often

const DetectionShape& largest_shape(const DetectionShapes& shapes, const Sighting& sighting) {
    return shapes[sighting.detections.front()];
}

BoxMeasurement first_measurement(const DetectionShapes& shapes, const Sighting& sighting, const OrientedBox& visible,
                                 const KalmanConfig& config) {
    BoxMeasurement m = complete_extent(visible, assumed_box(visible, sighting.visibility), sighting.visibility, config);
    const DetectionShape& shape = largest_shape(shapes, sighting);
    m.age_s = shape.age_s;
    m.yaw_sd_rad = shape.axis.elongation > kElongated ? 0.2 : 1.0;
    m.size_sd_m = m.size_sd_m.cwiseMin(0.5);
    return m;
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
      origin_m_(filter_.box().center_m) {
    std::vector<OrientedBox> nothing_to_clear;
    see(frame, shapes, sighting, config, nothing_to_clear);
}

void TrackedObject::predict(double dt_s, const TrackingConfig& config) {
    filter_.predict(dt_s, config.filter);
    unseen_s_ += dt_s;
    before_.age_s += dt_s;
    since_.age_s += dt_s;
    seen_now_ = false;
    ++age_;
}

std::pair<double, double> TrackedObject::measured_yaw(const PrincipalAxis& axis) {
    const Eigen::Vector3d velocity = filter_.velocity();
    const double speed = filter_.speed();
    const double sd = filter_.velocity_sd();
    const OrientedBox box = filter_.box();
    const bool long_object = box.size_m.head<2>().maxCoeff() > 1.5 && axis.elongation > kElongated;
    if (speed > kHeadingSpeed_mps && speed > 2.0 * sd) {
        const double heading = std::atan2(velocity.y(), velocity.x());
        filter_.align_axes(heading);
        // The sides of a long object are known better than its heading.
        if (long_object && std::abs(std::remainder(axis.yaw_rad - heading, std::numbers::pi)) < 0.5)
            return {axis.yaw_rad, 0.1};
        return {heading, std::max(0.1, sd / speed)};
    }
    if (long_object) {
        filter_.align_axes(resolve_yaw(axis.yaw_rad, box.yaw_rad));
        return {axis.yaw_rad, 0.15};
    }
    return {box.yaw_rad, 10.0};
}

void TrackedObject::see(const Frame& frame, const DetectionShapes& shapes, const Sighting& sighting,
                        const TrackingConfig& config, std::vector<OrientedBox>& cleared) {
    const DetectionShape& shape = largest_shape(shapes, sighting);
    if (hits_ > 0) {
        const auto [yaw, yaw_sd] = measured_yaw(shape.axis);
        const OrientedBox remembered = filter_.box();
        visible_ = visible_box(frame, shapes, sighting, remembered.yaw_rad);
        BoxMeasurement m = complete_extent(visible_, remembered, sighting.visibility, config.filter);
        m.age_s = shape.age_s;
        m.box.yaw_rad = yaw;
        m.yaw_sd_rad = yaw_sd;
        filter_.update(m, config.filter);
    }
    // At the stamp, as the filter's centre.
    visible_.center_m += shape.age_s * filter_.velocity() - filter_.box().center_m;

    MotionCues cues;
    double residual_sum = 0.0;
    points_ = 0;
    for (std::size_t d : sighting.detections) {
        const Detection& part = frame.detection.detections[d];
        residual_sum += part.average_residual_m * part.residual_points;
        cues.residual_points += part.residual_points;
        cues.free_points += part.free_points;
        cues.occupied_points += part.occupied_points;
        cues.unknown_points += part.unknown_points;
        points_ += static_cast<int>(part.count);
    }
    cues.average_residual_m = cues.residual_points > 0 ? residual_sum / cues.residual_points : 0.0;
    cues.height_m = visible_.size_m.z();
    cues.shift_m = (filter_.box().center_m - origin_m_).head<2>().norm();
    cues.dt_s = unseen_s_;
    cues.position_m = filter_.box().center_m.head<2>();
    if (config.state.use_displacement && !clear_without_displacement(cues)) displacement_cue(frame, sighting, cues);

    ++hits_;
    misses_ = 0;
    unseen_frames_ = 0;
    unseen_s_ = 0.0;
    seen_now_ = true;
    residual_m_ = cues.average_residual_m;
    if (belief_.update(cues, config.state)) {
        history_.release(cleared);
        cleared.push_back(filter_.box());
    } else if (belief_.state() != DynamicState::kDynamic) {
        OrientedBox world = visible_;
        world.center_m += filter_.box().center_m;
        history_.add(world);
    }
}

void TrackedObject::miss(Sight sight) {
    sight_ = sight;
    misses_ += sight == Sight::kNearer ? 0 : sight == Sight::kFarther ? 2 : 1;
    ++unseen_frames_;
}

bool TrackedObject::visible_to_others() const {
    if (seen_now_) return true;
    if (belief_.state() != DynamicState::kDynamic || hits_ < kEstablishedHits || unseen_frames_ > hits_) return false;
    return sight_ == Sight::kNearer || sight_ == Sight::kThere ||
           (sight_ == Sight::kUnknown && unseen_frames_ <= kBlindFrames);
}

bool TrackedObject::dead(const TrackingConfig& config) const {
    const bool established =
        hits_ >= kEstablishedHits && (belief_.state() == DynamicState::kDynamic || hits_ > config.max_misses);
    if (unseen_frames_ > (established ? config.max_misses_occluded : config.max_misses)) return true;
    return misses_ > (established ? config.max_misses : config.max_misses_undecided);
}

bool TrackedObject::clear_without_displacement(const MotionCues& cues) const {
    const double share = free_share(cues);
    if (share < 0.0 || hits_ == 0 || agreeing_ > 0) return false;
    if (filter_.speed() > kHeadingSpeed_mps && filter_.speed() > 2.0 * filter_.velocity_sd())
        return belief_.state() == DynamicState::kDynamic && share > 0.3;
    if (belief_.state() == DynamicState::kDynamic) return share > 0.3;
    return belief_.state() == DynamicState::kStatic && share < 0.05;
}

void TrackedObject::displacement_cue(const Frame& frame, const Sighting& sighting, MotionCues& cues) {
    PointSample now;
    const Detection& part = frame.detection.detections[sighting.detections.front()];
    sample_points(frame, std::span(frame.detection.pixels).subspan(part.first, part.count), now);
    const Eigen::Vector2d center = filter_.box().center_m.head<2>();
    if (hits_ == 0) {
        before_ = since_ = now;
        before_center_m_ = since_center_m_ = center;
    } else if (before_.age_s > kStale_s) {
        // It was not asked for a while: begin anew.
        before_ = since_ = now;
        before_center_m_ = since_center_m_ = center;
    } else {
        const auto r = register_displacement(before_, now, center - before_center_m_);
        cues.displacement_log_odds = displacement_log_odds(r, before_.age_s);
        const Eigen::Vector2d expected = before_.age_s * filter_.velocity().head<2>();
        const bool agrees = cues.displacement_log_odds > 0.0 && r.displacement_m.norm() > kAgreeing_m &&
                            (r.displacement_m - expected).norm() < kAgreement * r.displacement_m.norm();
        agreeing_ = agrees ? agreeing_ + 1 : 0;
        cues.sustained_displacement = agreeing_ >= kAgreeingFrames;
    }
    if (since_.age_s > kReference_s) {
        before_ = since_;
        before_center_m_ = since_center_m_;
        since_ = now;
        since_center_m_ = center;
    }
}

ExpectedTrack TrackedObject::expected() const {
    ExpectedTrack e;
    e.visible = visible_;
    e.visible.center_m += filter_.box().center_m;
    e.filter = &filter_;
    e.points = points_;
    e.young = hits_ < kYoungHits;
    e.steady = steady();
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
