#include "core/tracking/dynamic_state.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {

namespace {

constexpr int kMinTested = 5;             // points: fewer say nothing about free space
constexpr double kPatience = 10.0;        // tested points that count for half of full trust
constexpr double kFewTested = 40.0;       // points: with more, a smaller share is neutral, down to
constexpr double kLeastNeutral = 0.3;     // this part of free_fraction
constexpr double kTall_m = 0.4;           // detections of that height count in full
constexpr double kMostUnconfirmed = 0.6;  // of what makes an object dynamic, without free space
// What walks away hides the space that it enters: nobody can have seen it free, and its old places look occupied.
constexpr double kSustained = 0.7;    // least trust in a displacement that agrees with the track's velocity for a while
constexpr double kWalked = 1.5;       // log-odds of a way longer than the object
constexpr double kUnconfirmed = 0.3;  // trust in a displacement where no free space was tested
constexpr double kMaxLogOdds = 8.0;   // bounds keep a belief reversible
constexpr double kStands = -1.0;      // log-odds of a frame in which its own points lie where they were
constexpr double kMaxStep = 2.4;      // one frame alone never decides
constexpr double kAway_m = 0.15;      // from the mean place of rest
constexpr double kRestMean = 0.1;     // weight of a new position in that mean
constexpr double kResting = 0.5;      // of the time of rest
constexpr double kOwnWay = 0.6;       // of its length: the middle of what comes into view goes half of that
constexpr double kFar_m = 3.0;        // of a car; buses need go no farther
constexpr int kAwayDetections = 2;    // in a row off the place of rest: it has set off
constexpr double kSettingOff_s = 1.0;   // until it has left that place
constexpr double kOutOfSight_s = 0.45;  // what is found after longer may be something else
constexpr int kFewFree = 3;             // one tested point in so many lies in free space of what surely moves

}  // namespace

void MotionCues::take_walked_way() {
    displacement_log_odds = std::max(displacement_log_odds, kWalked);
    sustained_displacement = true;
    left_its_place = true;
}

double free_share(const MotionCues& cues) {
    const int tested = cues.free_points + cues.occupied_points;
    return tested < kMinTested ? -1.0 : static_cast<double>(cues.free_points) / tested;
}

double motion_log_odds(const MotionCues& cues, const DynamicStateConfig& config) {
    double sum = 0.0;
    double trust =
        1.0;  // in what speaks for motion: what has moved stands, at least with its front, where free space was
    if (config.use_free_space) {
        const double share = free_share(cues);
        trust = kUnconfirmed;
        if (share >= 0.0) {
            const double tested = cues.free_points + cues.occupied_points;
            // The unknown says nothing; but where most is unknown, what is known is an edge more often.
            const double known = std::sqrt(tested / (tested + cues.unknown_points));
            // A single row is as often an edge seen at a grazing angle as a thing of its own.
            const double tall = std::min(1.0, cues.height_m / kTall_m);
            // Errors come in a few pixels: the more were tested, the smaller a share is believed in. Of a long object
            // that sets off only the front stands where free space was.
            const double neutral =
                config.free_fraction * std::clamp(std::sqrt(kFewTested / tested), kLeastNeutral, 1.0);
            const double excess = std::clamp(share / neutral - 1.0, -1.0, 2.0);
            const double term = config.free_weight * excess * known * tall * tested / (tested + kPatience);
            sum += cues.sustained_displacement ? std::max(0.0, term) : term;
            trust = known * std::min(1.0, share / neutral);
        }
    }
    if (cues.sustained_displacement) trust = std::max(trust, kSustained);
    // Panes show now this, now that, where others saw through them: the object itself has not moved for all that.
    if (cues.stands) {
        sum = std::min(sum, 0.0);
        trust = 0.0;
    }
    if (config.use_residual && cues.residual_points > 0 && cues.height_m > 0.0) {
        const double ratio = cues.average_residual_m / std::max(1e-3, config.theta_res * cues.height_m);
        const double excess = std::clamp(ratio - 1.0, -1.0, 2.0);
        const double against = cues.residual_would_show ? excess : 0.0;
        sum += config.residual_weight * (excess > 0.0 ? trust * excess : against);
    }
    if (config.use_displacement) {
        const double moved = cues.displacement_log_odds;
        sum += config.displacement_weight * (moved > 0.0 ? trust * moved : moved);
    }
    return std::clamp(sum, -kMaxStep, kMaxStep);
}

bool MotionBelief::has_set_off() const {
    return state_ == DynamicState::kDynamic && has_set_off_ && dynamic_s_ < kSettingOff_s;
}

bool MotionBelief::update(const MotionCues& cues, const DynamicStateConfig& config) {
    ++detections_;
    const bool was_dynamic = state_ == DynamicState::kDynamic;
    const bool paper = config.use_residual && !config.use_free_space && !config.use_displacement;
    state_ = paper ? by_paper(cues, config) : fused(cues, config);
    return state_ == DynamicState::kDynamic && !was_dynamic;
}

DynamicState MotionBelief::by_paper(const MotionCues& cues, const DynamicStateConfig& config) const {
    if (state_ == DynamicState::kDynamic) return state_;
    if (detections_ >= config.n_min && cues.average_residual_m >= config.theta_res * cues.height_m &&
        cues.shift_m >= config.theta_disp_m) {
        return DynamicState::kDynamic;
    }
    return detections_ >= config.n_max ? DynamicState::kStatic : state_;
}

// At rest is what has stayed within a small circle: a slow walk leaves it, noise does not.
void MotionBelief::rest(const MotionCues& cues, const DynamicStateConfig& config) {
    const double distance = (cues.position_m - anchor_m_).norm();
    if (rested_) {
        off_anchor_ = distance > kAway_m ? off_anchor_ + 1 : 0;
        if (off_anchor_ == 0) anchor_m_ += kRestMean * (cues.position_m - anchor_m_);
        return;
    }
    rest_s_ += cues.dt_s;
    if (distance > config.rest_radius_m) {
        anchor_m_ = cues.position_m;
        rest_s_ = 0.0;
    }
}

DynamicState MotionBelief::fused(const MotionCues& seen, const DynamicStateConfig& config) {
    MotionCues cues = seen;
    // What is known to move has stopped, and a door's leaf hardly moves at its hinge.
    has_turned_ = has_turned_ || seen.turned;
    cues.stands = config.use_displacement && seen.stands && !known_to_move_ && !has_turned_;
    double step = motion_log_odds(cues, config);
    // What comes into view where nothing was ever seen differs from the map, too: that makes it a suspect, no more.
    if (config.use_free_space && free_share(cues) < 0.0 && !cues.sustained_displacement) {
        step = std::min(step, std::max(0.0, kMostUnconfirmed * config.dynamic_log_odds - log_odds_));
    }
    // What is found again after a while moves if it stands in free space; else it may be something that rests there,
    // and its own motion has to be seen anew.
    const int tested = cues.free_points + cues.occupied_points + cues.unknown_points;
    if (config.use_free_space && cues.dt_s > kOutOfSight_s && tested >= kMinTested &&
        kFewFree * cues.free_points < tested && state_ == DynamicState::kDynamic) {
        log_odds_ = std::min(log_odds_, 0.0);
        state_ = DynamicState::kUndefined;
    }
    // It moves where it has hidden the space, or been itself: what that space said against motion is taken back.
    if (cues.left_its_place) log_odds_ = std::max(log_odds_, 0.0);
    // Hundreds of points compared with two earlier frames, not one detection's guess: that decides alone.
    const bool sure = config.use_free_space && cues.turned;
    if (sure) log_odds_ = std::max(log_odds_, config.dynamic_log_odds);
    log_odds_ = std::clamp(log_odds_ + step, config.static_log_odds - 0.5, kMaxLogOdds);
    // What sets off stands where it stood itself: until it has left that place the free space does not speak for it.
    const bool sets_off = config.use_displacement && cues.set_off;
    if (sets_off && has_set_off()) log_odds_ = std::max(log_odds_, config.dynamic_log_odds);
    if (cues.stands && state_ == DynamicState::kDynamic)
        log_odds_ = std::min(log_odds_, config.dynamic_log_odds) + kStands;
    rest(cues, config);
    if (state_ == DynamicState::kDynamic) {
        // Where it has come to rest, the past says the same as where it has never moved: but what has long been
        // dynamic was none of that.
        const bool mistaken = log_odds_ <= (cues.stands ? 0.0 : config.static_log_odds);
        dynamic_s_ += cues.dt_s;
        way_m_ = std::max(way_m_, (cues.position_m - set_out_m_).norm());
        known_to_move_ =
            known_to_move_ || (dynamic_s_ >= config.rest_time_s && way_m_ > std::min(kOwnWay * cues.longest_m, kFar_m));
        const bool halted = mistaken && dynamic_s_ >= config.rest_time_s;
        rested_ = rest_s_ >= (halted ? kResting : 1.0) * config.rest_time_s;
        off_anchor_ = 0;
        if (!rested_ && !mistaken) return state_;
        // It had come to within a step of here when it began to rest.
        anchor_m_ = cues.position_m;
        log_odds_ = std::min(log_odds_, 0.0);
        return DynamicState::kStatic;
    }
    has_set_off_ = sets_off || (rested_ && off_anchor_ >= kAwayDetections);
    if (has_set_off_) {
        rested_ = false;
        log_odds_ = std::max(log_odds_, config.dynamic_log_odds);
    }
    // Where a rested object stands, free space was seen before it came: that says nothing of now.
    if (rested_) return state_;
    if (log_odds_ >= config.dynamic_log_odds && (sure || detections_ >= config.min_hits)) {
        rest_s_ = 0.0;
        dynamic_s_ = 0.0;
        way_m_ = 0.0;
        anchor_m_ = set_out_m_ = cues.position_m;
        return DynamicState::kDynamic;
    }
    const bool waited = detections_ >= config.n_max && log_odds_ < 0.5 * config.dynamic_log_odds;
    return waited || log_odds_ <= config.static_log_odds ? DynamicState::kStatic : state_;
}

}  // namespace dlod
