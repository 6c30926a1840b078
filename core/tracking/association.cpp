#include "core/tracking/association.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/tracking/box_iou.hpp"

namespace dlod {

namespace {

constexpr double kBeyond = 2.0;    // any gated distance above 1
constexpr double kSweep_s = 0.21;  // a detection's points are no older than a turn of the sensor takes
constexpr double kSlack_m = 0.1;
constexpr double kSlackOfSize = 0.15;
// Where two tracks compete for one detection, the other part of the object was hidden, or two parts are seen as one
// again: the established track is the object.
constexpr double kYouth = 0.3;
constexpr double kSameSize = 1.3;    // diagonals up to that ratio
constexpr double kSameSize_m = 0.5;  // and that much more are the same size
constexpr double kGrowth = 0.9;      // at twice of that and more

/// How a detection compares with one of a track's boxes.
struct Comparison {
    double distance = kBeyond;  ///< in units of the gate: above 1 the pair is out of the question
    double iou = 0.0;
};

/// @param offset_m of the detection's middle in the ground plane from where the box has it
/// @param slack_m it may be off by that much, apart from motion
Comparison compare_box(const ExpectedTrack& track, const OrientedBox& box, const CandidateDetection& detection,
                       const Eigen::Vector2d& offset_m, double slack_m, const AssociationConfig& config) {
    Comparison c;
    const double distance = offset_m.norm();
    const double reach = config.max_speed_mps * track.dt_s + slack_m;
    if (distance > reach) return c;
    if (track.young) {
        c.distance = distance / reach;
    } else {
        const Eigen::Vector2d expected = track.whole.center_m.head<2>() + offset_m;
        const double d2 =
            track.filter->plane_distance2(expected, detection.age_s, slack_m * slack_m * Eigen::Matrix2d::Identity());
        c.distance = std::sqrt(d2) / config.gate_sigma;
    }
    if (c.distance <= 1.0) c.iou = box_iou(box, detection.visible);
    return c;
}

/// What is smaller than the whole may be anywhere inside of it: how far its middle is from the nearest such place.
Eigen::Vector2d offset_from_inside(const OrientedBox& whole, const OrientedBox& part) {
    const Eigen::Vector2d along(std::cos(whole.yaw_rad), std::sin(whole.yaw_rad));
    const Eigen::Vector2d across(-along.y(), along.x());
    const Eigen::Vector2d offset = (part.center_m - whole.center_m).head<2>();
    const double c = std::abs(std::cos(part.yaw_rad - whole.yaw_rad)),
                 s = std::abs(std::sin(part.yaw_rad - whole.yaw_rad));
    const auto beyond = [](double off, double room) {
        return std::copysign(std::max(0.0, std::abs(off) - 0.5 * std::abs(room)), off);
    };
    return beyond(along.dot(offset), whole.size_m.x() - c * part.size_m.x() - s * part.size_m.y()) * along +
           beyond(across.dot(offset), whole.size_m.y() - s * part.size_m.x() - c * part.size_m.y()) * across;
}

/// Against the visible box of the last sighting or, where the object is seen better or worse than then, its whole box.
Comparison compare(const ExpectedTrack& track, const CandidateDetection& detection, const AssociationConfig& config) {
    const Eigen::Vector2d offset = (detection.visible.center_m - track.visible.center_m).head<2>();
    // Visible boxes shift by a part of their size when limbs and sides come and go.
    const double size = detection.visible.size_m.head<2>().norm();
    const double slack = kSlack_m + kSlackOfSize * std::min(track.visible.size_m.head<2>().norm(), size);
    const Comparison visible = compare_box(track, track.visible, detection, offset, slack, config);
    if (!track.established) return visible;
    const Comparison whole =
        compare_box(track, track.whole, detection, offset_from_inside(track.whole, detection.visible), slack, config);
    return {std::min(visible.distance, whole.distance), std::max(visible.iou, whole.iou)};
}

/// A pair's cost never rises above that of no match.
double with_youth(double cost, const ExpectedTrack& track, const AssociationConfig& config) {
    return track.established ? cost : std::min(cost + kYouth, 0.5 * (cost + config.unmatched_cost));
}

/// Cost of believing that an object is suddenly much larger than it was: it has merged with something else.
double growth(const ExpectedTrack& track, const CandidateDetection& detection) {
    if (!track.established) return 0.0;
    const double known = kSameSize * track.whole.size_m.head<2>().norm() + kSameSize_m;
    return kGrowth * std::clamp(detection.visible.size_m.head<2>().norm() / known - 1.0, 0.0, 1.0);
}

/// Cost of believing two contradicting things about motion.
double contradiction(const ExpectedTrack& track, const CandidateDetection& detection, const AssociationConfig& config) {
    return config.evidence_weight * std::max(0.0, -track.motion * detection.motion);
}

double relative_difference(double a, double b) {
    return a == b ? 0.0 : 1.0 - std::min(a, b) / std::max(a, b);
}

int root_of(std::vector<int>& parent, int i) {
    while (parent[static_cast<std::size_t>(i)] != i) {
        auto& up = parent[static_cast<std::size_t>(i)];
        up = parent[static_cast<std::size_t>(up)];
        i = up;
    }
    return i;
}

/// A detection whose middle is farther from that of the track's whole box is beyond the gate, its own size apart.
double reach_of(const ExpectedTrack& track, const AssociationConfig& config) {
    const double size = std::max(track.visible.size_m.head<2>().norm(), track.whole.size_m.head<2>().norm());
    const double slack = kSlack_m + kSlackOfSize * size;
    double reach = config.max_speed_mps * track.dt_s + slack;
    if (!track.young) {
        const double sd = track.filter->position_sd() + kSweep_s * track.filter->velocity_sd();
        const double moved = kSweep_s * track.filter->speed();  // before its points are seen
        reach = std::min(reach, moved + config.gate_sigma * std::hypot(sd, slack));
    }
    const double between = (track.visible.center_m - track.whole.center_m).head<2>().norm();
    return reach + between + 0.5 * size;
}

}  // namespace

double Association::cost(double iou, int points_a, int points_b, const AssociationConfig& config) {
    return config.alpha * (1.0 - iou) + config.beta * relative_difference(points_a, points_b);
}

void Association::set_places(std::span<const CandidateDetection> detections) {
    places_.clear();
    for (const CandidateDetection& detection : detections) {
        const OrientedBox& box = detection.visible;
        places_.push_back({box.center_m.x(), box.center_m.y(), 0.5 * box.size_m.head<2>().norm()});
    }
}

// Most pairs are far apart: they are not to cost more than a glance.
void Association::find_candidates(std::span<const ExpectedTrack> tracks, std::span<const CandidateDetection> detections,
                                  const AssociationConfig& config) {
    set_places(detections);
    candidates_.clear();
    for (std::size_t t = 0; t < tracks.size(); ++t) {
        if (detection_of_[t] >= 0) continue;
        const double x = tracks[t].whole.center_m.x(), y = tracks[t].whole.center_m.y();
        const double reach = reach_of(tracks[t], config);
        for (std::size_t d = 0; d < detections.size(); ++d) {
            const double dx = places_[d].x_m - x, dy = places_[d].y_m - y, most = reach + places_[d].reach_m;
            if (dx * dx + dy * dy > most * most || track_of_[d] >= 0) continue;
            const Comparison boxes = compare(tracks[t], detections[d], config);
            if (boxes.distance > 1.0) continue;
            candidates_.push_back({static_cast<int>(t), static_cast<int>(d), boxes.distance, boxes.iou});
        }
    }
}

const std::vector<int>& Association::solve(std::span<const ExpectedTrack> tracks,
                                           std::span<const CandidateDetection> detections,
                                           const AssociationConfig& config, std::span<const int> known) {
    detection_of_.assign(tracks.size(), -1);
    track_of_.assign(detections.size(), -1);
    for (std::size_t d = 0; d < known.size(); ++d) {
        if (known[d] >= 0) match(known[d], static_cast<int>(d));
    }
    find_candidates(tracks, detections, config);

    pairs_.clear();
    for (const Candidate& candidate : candidates_) {
        const ExpectedTrack& track = tracks[static_cast<std::size_t>(candidate.track)];
        const CandidateDetection& detection = detections[static_cast<std::size_t>(candidate.detection)];
        // A box that fits is the object, whatever its evidence says of this frame.
        const double c = cost(candidate.iou, track.points, detection.points, config) +
                         contradiction(track, detection, config) * (1.0 - candidate.iou) + growth(track, detection);
        if (c < std::min(config.unmatched_cost, config.alpha))
            pairs_.push_back({candidate.track, candidate.detection, with_youth(c, track, config)});
    }
    assign(tracks.size(), detections.size(), config.unmatched_cost);
    if (!config.second_pass) return detection_of_;

    pairs_.clear();
    for (const Candidate& candidate : candidates_) {
        if (detection_of_[static_cast<std::size_t>(candidate.track)] >= 0 ||
            track_of_[static_cast<std::size_t>(candidate.detection)] >= 0)
            continue;
        const ExpectedTrack& track = tracks[static_cast<std::size_t>(candidate.track)];
        const CandidateDetection& detection = detections[static_cast<std::size_t>(candidate.detection)];
        const double c = 0.5 * candidate.distance +
                         0.3 * relative_difference(track.visible.size_m.z(), detection.visible.size_m.z()) +
                         0.2 * relative_difference(track.points, detection.points) +
                         contradiction(track, detection, config) + growth(track, detection);
        if (c < config.unmatched_cost)
            pairs_.push_back({candidate.track, candidate.detection, with_youth(c, track, config)});
    }
    assign(tracks.size(), detections.size(), config.unmatched_cost);
    return detection_of_;
}

void Association::match(int track, int detection) {
    detection_of_[static_cast<std::size_t>(track)] = detection;
    track_of_[static_cast<std::size_t>(detection)] = track;
}

// Pairs that share neither a track nor a detection, directly or by others, do not compete: each group of competitors is
// solved by itself, which keeps the cubic method to a handful of rows.
void Association::assign(std::size_t tracks, std::size_t detections, double unmatched_cost) {
    component_.resize(tracks + detections);
    std::iota(component_.begin(), component_.end(), 0);
    for (const Pair& pair : pairs_) {
        const int a = root_of(component_, pair.track);
        const int b = root_of(component_, static_cast<int>(tracks) + pair.detection);
        component_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
    std::sort(pairs_.begin(), pairs_.end(), [&](const Pair& a, const Pair& b) {
        const int ca = root_of(component_, a.track), cb = root_of(component_, b.track);
        return ca != cb ? ca < cb : a.track != b.track ? a.track < b.track : a.detection < b.detection;
    });
    row_of_.assign(tracks, -1);
    column_of_.assign(detections, -1);
    for (std::size_t first = 0; first < pairs_.size();) {
        std::size_t last = first;
        const int component = root_of(component_, pairs_[first].track);
        while (last < pairs_.size() && root_of(component_, pairs_[last].track) == component) ++last;
        assign_component(first, last, unmatched_cost);
        first = last;
    }
}

void Association::assign_component(std::size_t first, std::size_t last, double unmatched_cost) {
    if (last - first == 1) {
        match(pairs_[first].track, pairs_[first].detection);
        return;
    }
    rows_.clear();
    columns_.clear();
    for (std::size_t i = first; i < last; ++i) {
        int& row = row_of_[static_cast<std::size_t>(pairs_[i].track)];
        if (row < 0) {
            row = static_cast<int>(rows_.size());
            rows_.push_back(pairs_[i].track);
        }
        int& column = column_of_[static_cast<std::size_t>(pairs_[i].detection)];
        if (column < 0) {
            column = static_cast<int>(columns_.size());
            columns_.push_back(pairs_[i].detection);
        }
    }
    // A cell that is no pair costs what leaving both alone costs.
    cost_.assign(rows_.size() * columns_.size(), unmatched_cost);
    const auto cell = [&](const Pair& p) -> double& {
        return cost_[static_cast<std::size_t>(row_of_[static_cast<std::size_t>(p.track)]) * columns_.size() +
                     static_cast<std::size_t>(column_of_[static_cast<std::size_t>(p.detection)])];
    };
    for (std::size_t i = first; i < last; ++i) cell(pairs_[i]) = pairs_[i].cost;
    const std::vector<int>& column_of_row =
        hungarian_.solve(cost_, static_cast<int>(rows_.size()), static_cast<int>(columns_.size()));
    for (std::size_t i = first; i < last; ++i) {
        const Pair& p = pairs_[i];
        if (column_of_row[static_cast<std::size_t>(row_of_[static_cast<std::size_t>(p.track)])] ==
            column_of_[static_cast<std::size_t>(p.detection)]) {
            match(p.track, p.detection);
        }
    }
}

}  // namespace dlod
