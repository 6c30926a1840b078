#include "core/tracking/merged_detections.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace dlod {

namespace {

constexpr double kInside_m = 0.15;    // the middle of a covered track lies at most this far outside of the detection
constexpr double kLonger = 1.1;       // a detection of several objects is so much longer than each
constexpr double kSameObject = 0.35;  // tracks that share more of their footprints are one object seen twice
constexpr double kMinPart = 10;       // pixels of each part
constexpr double kMinShare = 0.25;    // of those that its track had: it was not hidden meanwhile
constexpr double kSeenShare = 0.5;    // of a track's pixels: there it is, if not whole
constexpr double kLargestBody_m = 1.5;
constexpr double kLeastHeight = 0.6;   // of the tallest: a lower one may be a limb of it
constexpr float kPlace_m = 0.4F;       // the middles of two bodies are no nearer
constexpr int kRounds = 3;             // of sharing by middles
constexpr double kMoving = 0.5;        // belief from which a track is worth being cut out
constexpr double kSameSize = 1.3;      // footprint diagonals up to that ratio
constexpr double kSameSize_m = 0.5;    // and that much more may be the track's
constexpr double kMargin_m = 0.2;      // what lies so far outside of its box is not
constexpr float kTwoPeople_m = 0.85F;  // two people are together at least that long above the legs, at most twice
constexpr double kLowest_m = 1.0;      // and so tall
constexpr double kTallest_m = 2.3;
constexpr float kGap_m = 0.05F;      // between their upper bodies,
constexpr float kGapColumns = 1.5F;  // more than neighbouring columns of the image are apart,
constexpr float kMiddle = 0.3F;      // in the middle of the whole
constexpr float kApart_m = 0.45F;    // and between their middles: not the halves of one behind a post
constexpr double kLong_m = 2.0;      // vehicles
constexpr double kLongMargin_m = 2.0;

double area(const OrientedBox& box) {
    return box.size_m.x() * box.size_m.y();
}

bool covers(const Detection& detection, const OrientedBox& box) {
    return footprint_distance_m(detection.box, box.center_m) < kInside_m &&
           std::abs(detection.box.center_m.z() - box.center_m.z()) < 0.5 * (detection.box.size_m.z() + box.size_m.z());
}

/// It is far larger than the track's object.
bool outgrows(const Detection& detection, const ExpectedTrack& track) {
    return detection.box.size_m.head<2>().norm() >= kSameSize * track.whole.size_m.head<2>().norm() + kSameSize_m;
}

bool same_object(const OrientedBox& a, const OrientedBox& b) {
    return footprint_intersection_m2(a, b) > kSameObject * std::min(area(a), area(b));
}

}  // namespace

bool MergedDetections::divide(Frame& frame, DetectionShapes& shapes, std::span<const ExpectedTrack> tracks,
                              std::span<const int> detection_of) {
    const std::size_t count = frame.detection.detections.size();
    cut_.clear();
    apart_.clear();
    known_.assign(count, -1);
    const auto seen_elsewhere = [&](std::size_t t, std::size_t detection) {
        const int d = detection_of[t];
        return d >= 0 && static_cast<std::size_t>(d) != detection &&
               frame.detection.detections[static_cast<std::size_t>(d)].count > kSeenShare * tracks[t].points;
    };
    for (std::size_t i = 0; i < count; ++i) {
        const Detection& detection = frame.detection.detections[i];
        covered_.clear();
        double longest = 0.0;
        const Eigen::Vector2d middle = detection.box.center_m.head<2>();
        const double reach = 0.5 * detection.box.size_m.head<2>().norm() + kInside_m;
        for (std::size_t t = 0; t < tracks.size(); ++t) {
            if ((tracks[t].visible.center_m.head<2>() - middle).squaredNorm() > reach * reach) continue;
            if (!tracks[t].steady || !covers(detection, tracks[t].visible) || seen_elsewhere(t, i)) continue;
            const bool twice = std::any_of(covered_.begin(), covered_.end(), [&](std::size_t other) {
                return same_object(tracks[t].visible, tracks[other].visible);
            });
            if (twice) continue;
            covered_.push_back(t);
            longest = std::max(longest, tracks[t].visible.longest_m());
        }
        const bool divided = covered_.size() > 1 && detection.box.longest_m() > kLonger * longest &&
                             share_out(detection, shapes, tracks);
        const auto moves_alone = [&](std::size_t t) { return cut_out(detection, shapes, tracks[t]); };
        const bool cut = !divided && std::any_of(covered_.begin(), covered_.end(), moves_alone);
        if (cut) cut_.push_back(i);
        const bool moves =
            std::any_of(covered_.begin(), covered_.end(), [&](std::size_t t) { return tracks[t].motion > kMoving; });
        const bool apart = !divided && !cut && covered_.size() == 1 && moves && fall_apart(detection, shapes, i);
        if (!divided && !cut && !apart) continue;
        const std::size_t next = frame.detection.detections.size();
        divide_one(frame, shapes, i);
        known_.resize(frame.detection.detections.size(), -1);
        for (std::size_t k = 0; divided && bodies_ && k < covered_.size(); ++k) {
            const std::size_t part = k == 0 ? i : next + k - 1;
            if (!outgrows(frame.detection.detections[part], tracks[covered_[k]]))
                known_[part] = static_cast<int>(covered_[k]);
        }
        if (apart) {
            apart_.push_back(i);
            apart_.push_back(next);
        }
    }
    return frame.detection.detections.size() > count;
}

bool MergedDetections::share_out(const Detection& whole, const DetectionShapes& shapes,
                                 std::span<const ExpectedTrack> tracks) {
    const PointSpan points = shapes.points(whole);
    owner_.resize(whole.count);
    counts_.assign(covered_.size(), 0);
    footprints_.clear();
    for (const std::size_t t : covered_) footprints_.emplace_back(tracks[t].visible);
    for (std::size_t i = 0; i < whole.count; ++i) {
        const Eigen::Vector3d p = shapes.origin() + Eigen::Vector3d(points.x[i], points.y[i], points.z[i]);
        double best = 0.0;
        for (std::size_t k = 0; k < covered_.size(); ++k) {
            const OrientedBox& box = tracks[covered_[k]].visible;
            // Inside of several boxes, the nearer middle decides.
            const double from_middle = 0.2 * (box.center_m - p).head<2>().norm();
            if (k > 0 && from_middle >= best) continue;
            const double distance = footprints_[k].distance_m(p) + from_middle;
            if (k == 0 || distance < best) {
                best = distance;
                owner_[i] = k;
            }
        }
        ++counts_[owner_[i]];
    }
    double tallest_m = 0.0;
    for (const std::size_t t : covered_) tallest_m = std::max(tallest_m, tracks[t].whole.size_m.z());
    const bool small = whole.box.longest_m() < kLargestBody_m * static_cast<double>(covered_.size());
    bodies_ = small && std::all_of(covered_.begin(), covered_.end(), [&](std::size_t t) {
                  const Eigen::Vector3d size = tracks[t].whole.size_m;
                  return size.head<2>().maxCoeff() < kLargestBody_m && size.z() > kLeastHeight * tallest_m;
              });
    for (int k = 0; bodies_ && k < kRounds; ++k) share_by_middles(whole, shapes);
    if (bodies_ && !stand_apart()) return false;
    for (std::size_t k = 0; k < covered_.size(); ++k) {
        const double expected = kMinShare * tracks[covered_[k]].points;
        if (static_cast<double>(counts_[k]) < std::max(kMinPart, expected)) return false;
    }
    return true;
}

// Nobody stands in another's place: parts of one body that two tracks share are nearer to each other.
bool MergedDetections::stand_apart() const {
    for (std::size_t a = 0; a < middles_.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
            const float dx = middles_[a].x - middles_[b].x, dy = middles_[a].y - middles_[b].y;
            if (dx * dx + dy * dy < kPlace_m * kPlace_m) return false;
        }
    }
    return true;
}

// Where they were expected decides who is who, but the points themselves say where each of them is.
void MergedDetections::share_by_middles(const Detection& whole, const DetectionShapes& shapes) {
    const PointSpan points = shapes.points(whole);
    const auto waist_m = static_cast<float>(whole.box.center_m.z() - shapes.origin().z());
    middles_.assign(counts_.size(), {});
    for (std::size_t i = 0; i < whole.count; ++i) {
        if (points.z[i] < waist_m) continue;  // legs swing
        Middle& m = middles_[owner_[i]];
        m.x += points.x[i];
        m.y += points.y[i];
        m.count += 1.0F;
    }
    const auto few = [](const Middle& m) { return m.count < static_cast<float>(kMinPart); };
    if (std::any_of(middles_.begin(), middles_.end(), few)) {
        middles_.clear();
        return;
    }
    for (Middle& m : middles_) {
        m.x /= m.count;
        m.y /= m.count;
    }
    counts_.assign(counts_.size(), 0);
    for (std::size_t i = 0; i < whole.count; ++i) {
        float best = 0.0F;
        for (std::size_t k = 0; k < middles_.size(); ++k) {
            const float dx = points.x[i] - middles_[k].x, dy = points.y[i] - middles_[k].y;
            const float d2 = dx * dx + dy * dy;
            if (k == 0 || d2 < best) {
                best = d2;
                owner_[i] = k;
            }
        }
        ++counts_[owner_[i]];
    }
}

bool MergedDetections::cut_out(const Detection& whole, const DetectionShapes& shapes, const ExpectedTrack& track) {
    if (track.motion < kMoving) return false;
    OrientedBox box = track.whole;
    if (!outgrows(whole, track)) return false;
    // More of a long object may come into view at its ends.
    box.size_m.x() += box.size_m.x() > kLong_m ? 2.0 * kLongMargin_m : 2.0 * kMargin_m;
    box.size_m.y() += 2.0 * kMargin_m;
    const PointSpan points = shapes.points(whole);
    owner_.resize(whole.count);
    counts_.assign(2, 0);
    const Footprint footprint(box);
    for (std::size_t i = 0; i < whole.count; ++i) {
        const Eigen::Vector3d p = shapes.origin() + Eigen::Vector3d(points.x[i], points.y[i], points.z[i]);
        owner_[i] = footprint.contains(p) ? 0 : 1;
        ++counts_[owner_[i]];
    }
    return static_cast<double>(counts_[0]) >= std::max(kMinPart, kMinShare * track.points) &&
           static_cast<double>(counts_[1]) >= kMinPart;
}

bool MergedDetections::fall_apart(const Detection& whole, const DetectionShapes& shapes, std::size_t index) {
    const Eigen::Vector3d size = whole.box.size_m;
    if (size.z() < kLowest_m || size.z() > kTallest_m || size.head<2>().maxCoeff() < kTwoPeople_m ||
        size.head<2>().maxCoeff() > 2.0F * kTwoPeople_m) {
        return false;
    }
    const PointSpan points = shapes.points(whole);
    const double yaw = shapes[index].axis.yaw_rad;
    const auto c = static_cast<float>(std::cos(yaw)), s = static_cast<float>(std::sin(yaw));
    const auto middle = static_cast<float>(whole.box.center_m.z() - shapes.origin().z());
    along_.clear();
    for (std::size_t i = 0; i < whole.count; ++i) {
        if (points.z[i] > middle) along_.push_back(c * points.x[i] + s * points.y[i]);
    }
    if (along_.size() < static_cast<std::size_t>(kMinPart)) return false;
    std::sort(along_.begin(), along_.end());
    const float length = along_.back() - along_.front();
    if (length < kTwoPeople_m) return false;
    float gap = 0.0F, border = 0.0F;
    for (std::size_t i = 1; i < along_.size(); ++i) {
        if (along_[i] - along_[i - 1] > gap) {
            gap = along_[i] - along_[i - 1];
            border = 0.5F * (along_[i] + along_[i - 1]);
        }
    }
    const float range_m = (whole.box.center_m - shapes.origin()).cast<float>().norm();
    const float place = (border - along_.front()) / length;
    if (gap < std::max(kGap_m, kGapColumns * column_rad_ * range_m) || place < kMiddle || place > 1.0F - kMiddle)
        return false;
    owner_.resize(whole.count);
    counts_.assign(2, 0);
    std::array<float, 2> sum{}, low{1e9F, 1e9F}, high{-1e9F, -1e9F};
    for (std::size_t i = 0; i < whole.count; ++i) {
        const float u = c * points.x[i] + s * points.y[i];
        const std::size_t k = u > border ? 1 : 0;
        owner_[i] = k;
        ++counts_[k];
        sum[k] += u;
        low[k] = std::min(low[k], points.z[i]);
        high[k] = std::max(high[k], points.z[i]);
    }
    for (std::size_t k = 0; k < 2; ++k) {
        if (static_cast<double>(counts_[k]) < kMinPart || high[k] - low[k] < 0.5F * static_cast<float>(size.z()))
            return false;
    }
    return sum[1] / static_cast<float>(counts_[1]) - sum[0] / static_cast<float>(counts_[0]) > kApart_m;
}

void MergedDetections::divide_one(Frame& frame, DetectionShapes& shapes, std::size_t index) {
    auto& detections = frame.detection.detections;
    const Detection whole = detections[index];
    const PointSpan points = shapes.points(whole);
    // Stable order by owner, in place of the whole.
    pixels_.assign(frame.detection.pixels.begin() + whole.first,
                   frame.detection.pixels.begin() + whole.first + whole.count);
    std::vector<std::int8_t>& motion = frame.detection.motion;
    if (!motion.empty()) motion_.assign(motion.begin() + whole.first, motion.begin() + whole.first + whole.count);
    x_.assign(points.x.begin(), points.x.end());
    y_.assign(points.y.begin(), points.y.end());
    z_.assign(points.z.begin(), points.z.end());
    LocalPoints& all = shapes.all_points();
    std::size_t to = whole.first;
    for (std::size_t k = 0; k < counts_.size(); ++k) {
        Detection part = whole;
        part.first = static_cast<std::uint32_t>(to);
        part.count = static_cast<std::uint32_t>(counts_[k]);
        const double share = static_cast<double>(counts_[k]) / whole.count;
        const auto shared = [&](int n) { return static_cast<int>(share * n + 0.5); };
        part.residual_points = shared(whole.residual_points);
        part.free_points = shared(whole.free_points);
        part.occupied_points = shared(whole.occupied_points);
        part.unknown_points = shared(whole.unknown_points);
        part.edge_points = shared(whole.edge_points);
        int free = 0, stood = 0;
        for (std::size_t i = 0; i < whole.count; ++i) {
            if (owner_[i] != k) continue;
            frame.detection.pixels[to] = pixels_[i];
            if (!motion.empty()) {
                motion[to] = motion_[i];
                free += motion_[i] > 0 ? 1 : 0;
                stood += motion_[i] < 0 ? 1 : 0;
            }
            all.x[to] = x_[i];
            all.y[to] = y_[i];
            all.z[to] = z_[i];
            ++to;
        }
        if (!motion.empty()) {
            part.free_points = free;
            part.occupied_points = stood + part.edge_points;
        }
        const std::size_t at = k == 0 ? index : detections.size();
        if (k == 0) {
            detections[index] = part;
        } else {
            detections.push_back(part);
        }
        shapes.recompute(frame, at);
    }
}

}  // namespace dlod
