#include "tools/eval/tracking_score.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/tracking/hungarian.hpp"
#include "tools/eval/mask_score.hpp"

namespace dlod::tools {
namespace {

constexpr double kMoving_mps = 0.1;
constexpr int kVisiblePoints = 40;
constexpr double kGate_m = 1.0;
constexpr double kBonusOfSameTrack_m = 0.3;
constexpr double kForbidden = 1e6;
constexpr double kHalfWay_s = 0.55;
constexpr double kShortestWay_m = 0.05;  // a shorter way has no direction

struct Match {
    std::size_t object, track;
    double distance_m;
};

double gate_m(const TruthObject& object) {
    return std::max(kGate_m, 0.5 * std::hypot(object.length_m, object.width_m));
}

double ground_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return (a - b).head<2>().norm();
}

/// Mean of the values that were put in, if any.
class Mean {
  public:
    void add(double value) {
        sum_ += value;
        ++count_;
    }
    std::optional<double> value() const { return count_ > 0 ? std::optional(sum_ / count_) : std::nullopt; }

  private:
    double sum_ = 0.0;
    int count_ = 0;
};

/// What it costs to assign a row to a column.
class CostTable {
  public:
    CostTable(std::size_t rows, std::size_t columns, double value)
        : rows_(rows), columns_(columns), values_(rows * columns, value) {}
    double& at(std::size_t row, std::size_t column) { return values_[row * columns_ + column]; }
    /// The column of each row at the least sum of costs, -1 where a row has none.
    std::vector<int> assignment() const {
        return Hungarian().solve(values_, static_cast<int>(rows_), static_cast<int>(columns_));
    }

  private:
    std::size_t rows_, columns_;
    std::vector<double> values_;
};

/// Walks over the frames and keeps the counts.
class TrackingScorer {
  public:
    TrackingScorer(const Truth& truth, const RunOutput& run, const Eigen::Isometry3d& T_true_run, double range_m,
                   int skip)
        : truth_(truth), run_(run), T_true_run_(T_true_run), range_m_(range_m), skip_(skip) {}

    TrackingScore score() {
        const std::vector<int> rows = answering_rows(truth_, run_);
        for (std::size_t j = 0; j < truth_.frames(); ++j) {
            load_frame(j, rows[j]);
            match_frame();
            for (const auto& object : objects_) first_seen_.try_emplace(object.id, j);
            for (const auto& match : matches_) first_match_.try_emplace(objects_[match.object].id, j);
            if (j >= static_cast<std::size_t>(skip_)) count_frame(j);
            for (const auto& match : matches_) last_track_[objects_[match.object].id] = tracks_[match.track].id;
        }
        return summary();
    }

  private:
    /// Objects to be found, objects that excuse a track, and dynamic tracks, all within range; true world.
    void load_frame(std::size_t j, int row) {
        objects_.clear();
        excuses_.clear();
        tracks_.clear();
        const Eigen::Vector3d& sensor = truth_.last_columns[j].T_world_sensor.translation();
        for (const auto& object : truth_.objects[j]) {
            if (object.id <= 0 || ground_distance(object.center_m, sensor) > range_m_) continue;
            if (object.speed_mps > kMoving_mps && object.visible_points >= kVisiblePoints) {
                objects_.push_back(object);
            } else if (object.ever_moves) {
                excuses_.push_back(object);
            }
        }
        if (row < 0) return;
        const auto found = run_.tracks.find(run_.frames[static_cast<std::size_t>(row)].seq);
        if (found == run_.tracks.end()) return;
        for (Track track : found->second) {
            track.box.center_m = T_true_run_ * track.box.center_m;
            track.velocity_mps = T_true_run_.linear() * track.velocity_mps;
            if (track.state != DynamicState::kDynamic || ground_distance(track.box.center_m, sensor) > range_m_)
                continue;
            tracks_.push_back(track);
        }
    }

    void match_frame() {
        matches_.clear();
        if (objects_.empty() || tracks_.empty()) return;
        CostTable cost(objects_.size(), tracks_.size(), kForbidden);
        for (std::size_t a = 0; a < objects_.size(); ++a) {
            const auto last = last_track_.find(objects_[a].id);
            for (std::size_t b = 0; b < tracks_.size(); ++b) {
                const double distance = ground_distance(objects_[a].center_m, tracks_[b].box.center_m);
                if (distance > gate_m(objects_[a])) continue;
                const bool same = last != last_track_.end() && last->second == tracks_[b].id;
                cost.at(a, b) = distance - (same ? kBonusOfSameTrack_m : 0.0);
            }
        }
        const std::vector<int> assigned = cost.assignment();
        for (std::size_t a = 0; a < objects_.size(); ++a) {
            if (assigned[a] < 0 || cost.at(a, static_cast<std::size_t>(assigned[a])) >= 0.5 * kForbidden) continue;
            const auto b = static_cast<std::size_t>(assigned[a]);
            matches_.push_back({a, b, ground_distance(objects_[a].center_m, tracks_[b].box.center_m)});
        }
    }

    void count_frame(std::size_t j) {
        object_frames_ += static_cast<int>(objects_.size());
        for (const auto& object : objects_) ++frames_of_object_[object.id];
        std::set<std::size_t> used;
        for (const auto& match : matches_) {
            const auto& object = objects_[match.object];
            const auto& track = tracks_[match.track];
            used.insert(match.track);
            const auto last = last_track_.find(object.id);
            if (last != last_track_.end() && last->second != track.id) ++id_switches_;
            ++frames_together_[{object.id, track.id}];
            ++frames_of_track_[track.id];
            distance_.add(match.distance_m);
            add_motion_error(j, object, track);
        }
        match_count_ += static_cast<int>(matches_.size());
        for (std::size_t b = 0; b < tracks_.size(); ++b) {
            if (used.contains(b)) continue;
            const bool excused = std::any_of(excuses_.begin(), excuses_.end(), [&](const TruthObject& object) {
                return ground_distance(object.center_m, tracks_[b].box.center_m) <= gate_m(object);
            });
            if (excused) continue;
            ++frames_of_track_[tracks_[b].id];
            ++false_tracks_;
        }
    }

    /// Compares velocity and heading with the object's own speed in the direction of its way over a second: box centres
    /// sway with arms and legs, by more than a pedestrian's speed from frame to frame.
    void add_motion_error(std::size_t j, const TruthObject& object, const Track& track) {
        const Eigen::Vector2d way = way_m(j, object);
        if (way.norm() < kShortestWay_m) return;
        motion_errors_.add(track.velocity_mps.head<2>(), object.speed_mps * way.normalized());
    }

    /// From where the object was half a second before frame j to where it will be half a second after, as far as known.
    Eigen::Vector2d way_m(std::size_t j, const TruthObject& object) const {
        const auto stamp = [&](std::size_t frame) { return truth_.last_columns[frame].stamp_s; };
        const auto find = [&](std::size_t frame) -> const TruthObject* {
            const auto& all = truth_.objects[frame];
            const auto at =
                std::find_if(all.begin(), all.end(), [&](const TruthObject& o) { return o.id == object.id; });
            return at == all.end() ? nullptr : &*at;
        };
        const TruthObject* from = &object;
        const TruthObject* to = &object;
        for (std::size_t k = j; k-- > 0 && stamp(j) - stamp(k) < kHalfWay_s;) {
            const TruthObject* o = find(k);
            if (o == nullptr) break;
            from = o;
        }
        for (std::size_t k = j + 1; k < truth_.frames() && stamp(k) - stamp(j) < kHalfWay_s; ++k) {
            const TruthObject* o = find(k);
            if (o == nullptr) break;
            to = o;
        }
        return (to->center_m - from->center_m).head<2>();
    }

    /// Frames in which objects and tracks are together under the best one-to-one pairing of identities over the run.
    int identity_true_positives() const {
        if (frames_of_object_.empty() || frames_of_track_.empty()) return 0;
        std::map<int, std::size_t> rows;
        std::map<std::uint32_t, std::size_t> columns;
        for (const auto& [id, frames] : frames_of_object_) rows.emplace(id, rows.size());
        for (const auto& [id, frames] : frames_of_track_) columns.emplace(id, columns.size());
        CostTable cost(rows.size(), columns.size(), 0.0);
        for (const auto& [pair, frames] : frames_together_)
            cost.at(rows.at(pair.first), columns.at(pair.second)) = -frames;
        const std::vector<int> assigned = cost.assignment();
        double together = 0.0;
        for (std::size_t a = 0; a < assigned.size(); ++a) {
            if (assigned[a] >= 0) together -= cost.at(a, static_cast<std::size_t>(assigned[a]));
        }
        return static_cast<int>(together);
    }

    TrackingScore summary() const {
        const auto at_least_one = [](int n) { return static_cast<double>(std::max(1, n)); };
        TrackingScore score;
        score.moving_objects = static_cast<int>(frames_of_object_.size());
        score.object_frames = object_frames_;
        const int misses = object_frames_ - match_count_;
        score.mota = 1.0 - (misses + false_tracks_ + id_switches_) / at_least_one(object_frames_);
        int identity_frames = object_frames_;
        for (const auto& [id, frames] : frames_of_track_) identity_frames += frames;
        score.idf1 = 2.0 * identity_true_positives() / at_least_one(identity_frames);
        score.recall = match_count_ / at_least_one(object_frames_);
        score.false_tracks_per_frame = false_tracks_ / at_least_one(static_cast<int>(truth_.frames()) - skip_);
        score.id_switches = id_switches_;
        score.never_found = static_cast<int>(first_seen_.size() - first_match_.size());
        std::vector<double> delays;
        for (const auto& [id, seen] : first_seen_) {
            const auto match = first_match_.find(id);
            delays.push_back(
                static_cast<double>((match == first_match_.end() ? truth_.frames() : match->second) - seen));
        }
        std::sort(delays.begin(), delays.end());
        score.delay_frames_median = quantile(delays, 0.5);
        score.delay_frames_p90 = quantile(delays, 0.9);
        score.centre_error_m = distance_.value().value_or(0.0);
        score.velocity_error_mps = motion_errors_.mean_velocity_mps();
        score.heading_error_deg = motion_errors_.mean_heading_deg();
        score.motion_errors = motion_errors_.table();
        return score;
    }

    const Truth& truth_;
    const RunOutput& run_;
    const Eigen::Isometry3d T_true_run_;
    const double range_m_;
    const int skip_;

    // of the frame at hand
    std::vector<TruthObject> objects_, excuses_;
    std::vector<Track> tracks_;
    std::vector<Match> matches_;

    // over the drive
    std::map<int, std::uint32_t> last_track_;
    std::map<int, std::size_t> first_seen_, first_match_;
    std::map<int, int> frames_of_object_;
    std::map<std::uint32_t, int> frames_of_track_;
    std::map<std::pair<int, std::uint32_t>, int> frames_together_;
    int object_frames_ = 0;
    int match_count_ = 0;
    int false_tracks_ = 0;
    int id_switches_ = 0;
    Mean distance_;
    MotionErrors motion_errors_;
};

}  // namespace

TrackingScore score_tracking(const Truth& truth, const RunOutput& run, const Eigen::Isometry3d& T_true_run,
                             double range_m, int skip) {
    return TrackingScorer(truth, run, T_true_run, range_m, skip).score();
}

}  // namespace dlod::tools
