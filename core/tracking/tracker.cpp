#include "core/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/tracking/association.hpp"
#include "core/tracking/box_iou.hpp"
#include "core/tracking/detection_shapes.hpp"
#include "core/tracking/merged_detections.hpp"
#include "core/tracking/object_parts.hpp"
#include "core/tracking/tracked_object.hpp"
#include "core/tracking/vehicle_parts.hpp"

namespace dlod {

namespace {

constexpr double kSimilar = 1.5;        // ratio of footprint diagonals
constexpr double kFree = 0.5;           // evidence of a part that stands where it was free
constexpr int kKnownHits = 4;           // from which on its velocity says what is a part of an object
constexpr double kSameFootprint = 0.4;  // parts above one another share that much of the smaller footprint
constexpr double kMaxGap_m = 0.5;       // and are at most that far apart in height
constexpr double kDuplicate = 0.6;      // an unseen track that shares that much with a seen one is the same object

/// Whether a track that is seen may be the object of one that is not: what moves is not taken for something that rests,
/// nor a person for what is far larger.
bool may_replace(const TrackedObject& seen, const TrackedObject& unseen) {
    if (unseen.state() != DynamicState::kDynamic || !unseen.steady()) return true;
    if (seen.drives()) return true;
    return seen.state() == DynamicState::kDynamic &&
           seen.box().size_m.head<2>().norm() < kSimilar * unseen.box().size_m.head<2>().norm();
}

CandidateDetection candidate(const Detection& detection, const DetectionShape& shape) {
    MotionCues cues;
    cues.free_points = detection.free_points;
    cues.occupied_points = detection.occupied_points;
    const double share = free_share(cues);
    CandidateDetection c;
    c.visible = detection.box;
    c.points = static_cast<int>(detection.count);
    c.age_s = shape.age_s;
    c.motion = share < 0.0 ? 0.0 : std::clamp(3.0 * share - 1.0, -1.0, 1.0);
    return c;
}

}  // namespace

struct Tracker::State {
    State(const SensorModel& sensor, const TrackingConfig& tracking, std::uint32_t first_id)
        : config(tracking), next_id(first_id), shapes(sensor), projection(sensor), merged(sensor) {
        objects.reserve(static_cast<std::size_t>(tracking.max_tracks));
    }

    void predict(const Frame& frame);
    void associate(Frame& frame);
    void give_way(std::size_t guest, TrackedObject& host, std::vector<OrientedBox>& cleared);
    void join_pieces(Frame& frame);
    void attach_parts(Frame& frame);
    void attach_to_young(Frame& frame);
    void see_and_miss(Frame& frame);
    void give_birth(Frame& frame);
    void publish(Frame& frame);
    Sighting sighting_of(const Frame& frame, std::size_t owner);

    TrackingConfig config;
    std::vector<TrackedObject> objects;  ///< by ascending id
    std::uint32_t next_id;
    std::int64_t stamp_ns = 0;
    bool started = false;

    DetectionShapes shapes;
    SweepProjection projection;
    MergedDetections merged;
    Association association;
    std::vector<ExpectedTrack> expected;
    std::vector<CandidateDetection> candidates;
    std::vector<int> owner;      ///< of each detection: index into objects, -1 none
    std::vector<char> absorbed;  ///< of each object: its detection belongs to another one
    std::vector<char> limb;      ///< of each detection: 1 beside its object's box: belongs to it, but does not shape it
    std::vector<std::size_t> parts;   ///< detections of the object at hand
    std::vector<std::size_t> strays;  ///< detections without an object
    std::vector<std::size_t> owned;   ///< detections with an object
    std::vector<PartHost> hosts;      ///< objects that have been found, and may have other parts
    std::vector<int> track_of_host;
    std::vector<OrientedBox> boxes;  ///< of the objects
    std::vector<double> reaches_m;   ///< and their half diagonals
    std::vector<int> row;            ///< of the objects among the published tracks
};

Tracker::Tracker(const SensorModel& sensor, const TrackingConfig& config, std::uint32_t first_id)
    : state_(std::make_unique<State>(sensor, config, first_id)) {}
Tracker::~Tracker() = default;

std::uint32_t Tracker::next_id() const {
    return state_->next_id;
}

void Tracker::process(Frame& frame) {
    frame.detection.tracks.clear();
    frame.detection.cleared.clear();
    // What was tracked stood elsewhere.
    if (frame.odometry.earlier_is_void()) state_->objects.clear();
    state_->predict(frame);
    if (frame.odometry.follows_map()) {
        state_->projection.set(frame.odometry);
        state_->associate(frame);
        state_->join_pieces(frame);
        state_->attach_parts(frame);
        state_->attach_to_young(frame);
        state_->see_and_miss(frame);
        state_->give_birth(frame);
    }
    state_->publish(frame);
}

void Tracker::State::predict(const Frame& frame) {
    const double dt_s = started ? 1e-9 * static_cast<double>(frame.header.stamp_ns - stamp_ns) : 0.0;
    stamp_ns = frame.header.stamp_ns;
    started = true;
    for (TrackedObject& object : objects) object.predict(std::max(0.0, dt_s), config);
    expected.clear();
    for (const TrackedObject& object : objects) expected.push_back(object.expected());
    owner.assign(frame.detection.detections.size(), -1);
}

void Tracker::State::associate(Frame& frame) {
    auto& detections = frame.detection.detections;
    shapes.compute(frame);
    const auto associated = [&](std::span<const int> known) -> const std::vector<int>& {
        candidates.clear();
        for (std::size_t d = 0; d < detections.size(); ++d) candidates.push_back(candidate(detections[d], shapes[d]));
        return association.solve(expected, candidates, config.association, known);
    };
    absorbed.assign(objects.size(), 0);
    const bool divided = merged.divide(frame, shapes, expected, associated({}));
    const std::vector<int>& detection_of = divided ? associated(merged.known_tracks()) : association.last();
    owner.assign(detections.size(), -1);
    for (std::size_t t = 0; t < detection_of.size(); ++t) {
        if (detection_of[t] >= 0) owner[static_cast<std::size_t>(detection_of[t])] = static_cast<int>(t);
    }
}

// What was a part of another object all the time leaves it its past.
void Tracker::State::give_way(std::size_t guest, TrackedObject& host, std::vector<OrientedBox>& cleared) {
    absorbed[guest] = 1;
    if (host.is_moving_vehicle()) host.take_past(objects[guest], cleared);
}

// One of two tracks on one vehicle gives its piece to the other, whose box takes it in.
void Tracker::State::join_pieces(Frame& frame) {
    const auto& detections = frame.detection.detections;
    owned.clear();
    for (std::size_t d = 0; d < detections.size(); ++d) {
        if (owner[d] >= 0) owned.push_back(d);
    }
    const auto object_of = [&](std::size_t d) -> TrackedObject& { return objects[static_cast<std::size_t>(owner[d])]; };
    const auto front_and_rest = [&](std::size_t front, std::size_t rest) {
        return candidates[front].motion > kFree && is_at_front_of(detections[rest], detections[front]) &&
               is_front_of(object_of(rest), object_of(front));
    };
    for (std::size_t i = 0; i < owned.size(); ++i) {
        for (std::size_t j = i + 1; j < owned.size(); ++j) {
            std::size_t of_host = owned[i], of_guest = owned[j];
            if (owner[of_host] == owner[of_guest]) continue;
            const bool divided = detections[of_host].segment == detections[of_guest].segment &&
                                 (front_and_rest(of_host, of_guest) || front_and_rest(of_guest, of_host));
            if (!divided && !pieces_of_one_vehicle(object_of(of_host), detections[of_host], object_of(of_guest),
                                                   detections[of_guest], frame, shapes, projection))
                continue;
            if (object_of(of_guest).goes_before(object_of(of_host))) std::swap(of_host, of_guest);
            object_of(of_host).join(detections[of_guest].box);
            expected[static_cast<std::size_t>(owner[of_host])].whole = object_of(of_host).box();
            give_way(static_cast<std::size_t>(owner[of_guest]), object_of(of_host), frame.detection.cleared);
            owner[of_guest] = owner[of_host];
        }
    }
}

// What is left may be a part of an object that was found.
void Tracker::State::attach_parts(Frame& frame) {
    const auto& detections = frame.detection.detections;
    const auto object = [&](int track) { return track < 0 ? nullptr : &objects[static_cast<std::size_t>(track)]; };
    limb.assign(detections.size(), 0);
    hosts.clear();
    track_of_host.clear();
    for (std::size_t d = 0; d < detections.size(); ++d) {
        if (owner[d] < 0 || !object(owner[d])->steady()) continue;
        const ExpectedTrack& as_expected = expected[static_cast<std::size_t>(owner[d])];
        hosts.emplace_back(*object(owner[d]), as_expected, detections[d], candidates[d]);
        track_of_host.push_back(owner[d]);
    }
    for (std::size_t d = 0; d < detections.size(); ++d) {
        if (merged.is_apart(d)) continue;
        const int own = owner[d];
        PartFit best;
        for (std::size_t h = 0; h < hosts.size(); ++h) {
            if (track_of_host[h] == own) continue;
            const auto fit = hosts[h].fit(detections[d], candidates[d], object(own), best.distance);
            if (!fit) continue;
            best = *fit;
            owner[d] = track_of_host[h];
        }
        limb[d] = best.limb ? 1 : 0;
        if (owner[d] == own) continue;
        if (own >= 0) give_way(static_cast<std::size_t>(own), *object(owner[d]), frame.detection.cleared);
        // Nobody has watched it before, and what of it was near the ground or apart may have been taken for static.
        if (own < 0 && object(owner[d])->is_moving_vehicle()) frame.detection.cleared.push_back(detections[d].box);
    }
}

// Of a vehicle that comes into view from behind something now these, now those pieces are seen.
void Tracker::State::attach_to_young(Frame& frame) {
    const auto& detections = frame.detection.detections;
    const auto free = [&](std::size_t d) { return candidates[d].motion > kFree && !merged.is_apart(d); };
    const auto object = [&](int track) -> const TrackedObject& { return objects[static_cast<std::size_t>(track)]; };
    for (std::size_t d = 0; d < detections.size(); ++d) {
        const int own = owner[d];
        if (!free(d) || (own >= 0 && object(own).steady())) continue;
        for (std::size_t h = 0; h < detections.size(); ++h) {
            const int host = owner[h];
            if (host < 0 || host == own || !free(h)) continue;
            if (object(host).hits() >= kKnownHits || object(host).state() == DynamicState::kStatic) continue;
            if (own >= 0 && !object(host).goes_before(object(own))) continue;
            if (!may_be_one_vehicle(detections[h], detections[d], frame, projection)) continue;
            owner[d] = host;
            if (own >= 0) absorbed[static_cast<std::size_t>(own)] = 1;
            break;
        }
    }
}

Sighting Tracker::State::sighting_of(const Frame& frame, std::size_t t) {
    const auto& detections = frame.detection.detections;
    parts.clear();
    for (std::size_t d = 0; d < detections.size(); ++d) {
        if (owner[d] == static_cast<int>(t)) parts.push_back(d);
    }
    // Not stable_sort, which allocates.
    std::sort(parts.begin(), parts.end(), [&](std::size_t a, std::size_t b) {
        if (limb[a] != limb[b]) return limb[a] < limb[b];
        return detections[a].count != detections[b].count ? detections[a].count > detections[b].count : a < b;
    });
    Sighting sighting;
    sighting.detections = parts;
    if (parts.empty()) return sighting;
    sighting.shape_parts = static_cast<std::size_t>(
        std::count_if(parts.begin(), parts.end(), [&](std::size_t d) { return limb[d] == 0; }));
    sighting.cut = merged.is_cut(parts.front());
    sighting.apart = merged.is_apart(parts.front());
    sighting.visibility.sensor_m = frame.odometry.T_world_sensor.translation();
    // Of several parts, the outermost say whether the ends are hidden.
    const Eigen::Vector2d ahead = (detections[parts.front()].centroid_m - sighting.visibility.sensor_m).head<2>();
    double leftmost = 0.0, rightmost = 0.0;
    for (std::size_t k = 0; k < sighting.shape_parts; ++k) {
        const Detection& part = detections[parts[k]];
        const Eigen::Vector2d to = (part.centroid_m - sighting.visibility.sensor_m).head<2>();
        const double left = std::atan2(ahead.x() * to.y() - ahead.y() * to.x(), ahead.dot(to));
        if (k == 0 || left > leftmost) {
            leftmost = left;
            sighting.visibility.occluded_left = part.occluded_left;
        }
        if (k == 0 || left < rightmost) {
            rightmost = left;
            sighting.visibility.occluded_right = part.occluded_right;
        }
    }
    return sighting;
}

void Tracker::State::see_and_miss(Frame& frame) {
    for (std::size_t t = 0; t < objects.size(); ++t) {
        const Sighting sighting = sighting_of(frame, t);
        if (!sighting.detections.empty()) objects[t].see(frame, shapes, sighting, config, frame.detection.cleared);
    }
    for (TrackedObject& object : objects) {
        if (!object.seen()) object.miss(look_at(object.box(), frame, projection));
    }
    // Two tracks on one object: the one that was not seen goes.
    boxes.clear();
    reaches_m.clear();
    for (const TrackedObject& object : objects) {
        boxes.push_back(object.box());
        reaches_m.push_back(reach_m(boxes.back()));
    }
    const auto duplicate = [&](std::size_t t) {
        if (objects[t].seen()) return false;
        if (absorbed[t] != 0) return true;
        for (std::size_t other = 0; other < objects.size(); ++other) {
            if (!objects[other].seen()) continue;
            const double most = reaches_m[t] + reaches_m[other];
            if ((boxes[t].center_m - boxes[other].center_m).head<2>().squaredNorm() > most * most) continue;
            if (may_replace(objects[other], objects[t]) && shared_footprint(boxes[t], boxes[other]) > kDuplicate)
                return true;
        }
        return false;
    };
    std::vector<std::size_t>& gone = parts;
    gone.clear();
    for (std::size_t t = 0; t < objects.size(); ++t) {
        if (objects[t].dead(config) || duplicate(t)) gone.push_back(t);
    }
    if (gone.empty()) return;
    for (int& t : owner) {
        if (t >= 0)
            t -= static_cast<int>(std::lower_bound(gone.begin(), gone.end(), static_cast<std::size_t>(t)) -
                                  gone.begin());
    }
    // Each of those that stay moves once: an object is some kilobytes.
    std::size_t to = gone.front();
    for (std::size_t t = to, g = 0; t < objects.size(); ++t) {
        if (g < gone.size() && gone[g] == t) {
            ++g;
        } else {
            objects[to++] = std::move(objects[t]);
        }
    }
    objects.erase(objects.begin() + static_cast<std::ptrdiff_t>(to), objects.end());
}

// The largest detections first; what stands above or below one of them is the same object.
void Tracker::State::give_birth(Frame& frame) {
    const auto& detections = frame.detection.detections;
    strays.clear();
    for (std::size_t d = 0; d < detections.size(); ++d) {
        if (owner[d] < 0) strays.push_back(d);
    }
    std::sort(strays.begin(), strays.end(), [&](std::size_t a, std::size_t b) {
        return detections[a].count != detections[b].count ? detections[a].count > detections[b].count : a < b;
    });
    for (std::size_t i = 0; i < strays.size() && objects.size() < static_cast<std::size_t>(config.max_tracks); ++i) {
        const std::size_t d = strays[i];
        if (owner[d] >= 0) continue;
        const auto t = static_cast<int>(objects.size());
        owner[d] = t;
        for (std::size_t j = i + 1; j < strays.size(); ++j) {
            const OrientedBox& part = detections[strays[j]].box;
            if (owner[strays[j]] >= 0) continue;
            const bool stacked = shared_footprint(detections[d].box, part) > kSameFootprint &&
                                 height_gap_m(detections[d].box, part) < kMaxGap_m;
            const bool pieces = candidates[d].motion > kFree && candidates[strays[j]].motion > kFree &&
                                may_be_one_vehicle(detections[d], detections[strays[j]], frame, projection);
            if (stacked || pieces) owner[strays[j]] = t;
        }
        objects.emplace_back(next_id++, frame, shapes, sighting_of(frame, static_cast<std::size_t>(t)), config);
    }
}

void Tracker::State::publish(Frame& frame) {
    row.assign(objects.size(), -1);
    for (std::size_t t = 0; t < objects.size(); ++t) {
        if (!objects[t].visible_to_others()) continue;
        row[t] = static_cast<int>(frame.detection.tracks.size());
        frame.detection.tracks.push_back(objects[t].published());
    }
    for (std::size_t d = 0; d < owner.size(); ++d) {
        frame.detection.detections[d].track = owner[d] < 0 ? -1 : row[static_cast<std::size_t>(owner[d])];
    }
}

}  // namespace dlod
