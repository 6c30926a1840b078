#include "core/evidence/plate_turn.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr int kFewestPoints = 16;
constexpr double kPlane = 0.7;        // of the points lay in one plane before, too
constexpr double kPartOfPlane = 0.3;  // where it has come nearer: the rest has been seen beside it
constexpr double kHeightMargin_m = 0.1;
constexpr double kEndMargin_m = 0.05;
constexpr double kBin_m = 0.04;  // along the plate, where its ends are looked for
constexpr int kBins = 256;
constexpr int kMostGaps = 2;     // bins within the plate that few of its points fall into
constexpr double kMostly = 0.5;  // of the points in a bin
constexpr int kFewestSeen = 4;
constexpr double kTold_m = 0.005;     // the mean of some points tells such a shift
constexpr double kStayed = 0.5;       // of the shift that is expected
constexpr double kFarther = 1.5;      // of the shift of its free end
constexpr double kHinge = 0.5;        // of its length a plate's axis may lie beyond its ends
constexpr double kCorrelated = 4.0;   // windows of neighbours share pixels
constexpr double kFloor_rad = 0.003;  // of a direction, however many points: pose, ranges, walls that are not flat
constexpr double kSigmas = 5.0;

}  // namespace

double PlateTurn::far_shift_m() const {
    const double far_m = std::max(std::abs(hinge_m - from_m), std::abs(hinge_m - to_m));
    return far_m * std::abs(std::sin(turn_rad));
}

double PlateTurn::most_shift_m(double tolerance_m) const {
    return kFarther * far_shift_m() + tolerance_m;
}

bool PlateTurn::is_hinged() const {
    return hinge_m > from_m - kHinge * length_m() && hinge_m < to_m + kHinge * length_m();
}

bool PlateTurn::is_far_from_axis(const Eigen::Vector3d& point, double tolerance_m) const {
    const bool hinge_first = std::abs(hinge_m - from_m) < std::abs(hinge_m - to_m);
    const double middle_m = 0.5 * (from_m + to_m);
    const double at = now.at(point.head<2>());
    return at >= (hinge_first ? middle_m : from_m) && at <= (hinge_first ? to_m : middle_m) && point.z() >= low_m &&
           point.z() <= high_m && std::abs(now.across(point.head<2>())) <= tolerance_m;
}

PlateTurnFit::PlateTurnFit(const TurnedPlatesConfig& config, std::size_t most_points) : config_(config) {
    formers_.reserve(most_points);
}

std::optional<PlateTurn> PlateTurnFit::find(std::span<const PlatePoint> points, const PlatePlace& place,
                                            std::size_t reference) {
    Window window{.points = points,
                  .reference = reference,
                  .low_m = place.low_m - kHeightMargin_m,
                  .high_m = place.high_m + kHeightMargin_m,
                  .reach_m = kPlateReach_m,
                  .side = place.side};
    const Eigen::Vector2d anchor = place.line.middle + 0.5 * (place.from_m + place.to_m) * place.line.along;
    PlateTurn turn;
    turn.now = place.line;
    turn.from_m = place.from_m - kEndMargin_m;
    turn.to_m = place.to_m + kEndMargin_m;
    for (int round = 0; round < 3; ++round) {
        if (!fit_planes(window, turn)) return std::nullopt;
        find_ends(window, anchor, turn);
        window.reach_m = config_.tolerance_m;
    }
    return is_significant(turn) ? std::optional(turn) : std::nullopt;
}

/// Of the points near the present plane, within its present ends: the plane now, that of before, and the turn.
bool PlateTurnFit::fit_planes(const Window& window, PlateTurn& turn) {
    const PlanLine start = turn.now;
    const auto used = [&](const PlatePoint& p) {
        if (!p.known[window.reference] || p.now.z() < window.low_m || p.now.z() > window.high_m) return false;
        const double at = start.at(p.now.head<2>());
        return at >= turn.from_m && at <= turn.to_m && std::abs(start.across(p.now.head<2>())) < window.reach_m;
    };
    turn.now = fit_line(start, [&](auto add) {
        for (const PlatePoint& p : window.points) {
            if (used(p)) add(p.now.head<2>());
        }
    });
    if (turn.now.points < kFewestPoints) return false;
    formers_.clear();
    for (const PlatePoint& p : window.points) {
        if (used(p)) formers_.push_back(p.before[window.reference].head<2>());
    }
    turn.before = most_common_line(formers_, turn.now, turn.length_m(), config_.tolerance_m);
    if (turn.before.points < (window.side > 0 ? kPlane : kPartOfPlane) * turn.now.points) return false;
    const double sine = turn.before.normal().dot(turn.now.along);
    turn.turn_rad = std::asin(std::clamp(sine, -1.0, 1.0));
    const double offset_m = turn.before.across(turn.now.middle);
    turn.hinge_m = std::abs(sine) > 1e-6 ? -offset_m / sine : 1e6;
    return true;
}

/// Both ends: to the axis, or else as far as points have moved.
void PlateTurnFit::find_ends(const Window& window, const Eigen::Vector2d& anchor, PlateTurn& turn) const {
    const PlanLine& now = turn.now;
    const PlanLine& before = turn.before;
    std::array<int, kBins> on{}, moved{}, all{}, seen{};
    std::array<double, kBins> shift_m{};
    const double most_m = turn.most_shift_m(config_.tolerance_m);
    const double first_m = now.at(anchor) - 0.5 * kBins * kBin_m;
    for (const PlatePoint& p : window.points) {
        if (p.now.z() < window.low_m || p.now.z() > window.high_m) continue;
        const double at = (now.at(p.now.head<2>()) - first_m) / kBin_m;
        if (at < 0.0 || at >= kBins) continue;
        const auto bin = static_cast<std::size_t>(at);
        const double a = std::abs(now.across(p.now.head<2>())), b = std::abs(before.across(p.now.head<2>()));
        ++all[bin];
        on[bin] += a < config_.tolerance_m ? 1 : 0;
        moved[bin] += a < config_.tolerance_m && a < b ? 1 : 0;
        const double d = now.across(p.before[window.reference].head<2>());
        if (a > config_.tolerance_m || !p.known[window.reference] || std::abs(d) > most_m) continue;
        shift_m[bin] += d;
        ++seen[bin];
    }
    // What lies in the plane beyond the axis, as a door's frame, has not moved.
    const auto stayed = [&](std::size_t bin) {
        const double at = first_m + (static_cast<double>(bin) + 0.5) * kBin_m;
        const double expected_m = -before.across(now.middle + at * now.along);
        if (std::abs(expected_m) < kTold_m || seen[bin] < kFewestSeen) return false;
        return shift_m[bin] / seen[bin] / expected_m < kStayed;
    };
    const auto end = [&](int direction) {
        const double hinge = (turn.hinge_m - first_m) / kBin_m;
        const double middle = 0.5 * kBins;
        const bool to_hinge = (hinge - middle) * direction > 0.0;
        int last = kBins / 2;
        int gap = 0;
        for (int bin = last; bin >= 0 && bin < kBins; bin += direction) {
            const auto i = static_cast<std::size_t>(bin);
            if (to_hinge && (bin + 0.5 - hinge) * direction > 0.0) break;
            if (to_hinge && stayed(i)) break;
            const int enough = to_hinge ? on[i] : moved[i];
            if (all[i] > 0 && enough >= kMostly * all[i]) {
                last = bin;
                gap = 0;
            } else if (++gap > kMostGaps) {
                break;
            }
        }
        const double last_m = first_m + (last + (direction > 0 ? 1 : 0)) * kBin_m;
        return to_hinge && (last_m - turn.hinge_m) * direction > 0.0 ? turn.hinge_m : last_m;
    };
    const double from_m = end(-1), to_m = end(1);
    turn.from_m = from_m;
    turn.to_m = to_m;
}

bool PlateTurnFit::is_significant(const PlateTurn& turn) const {
    if (turn.length_m() < config_.min_length_m || turn.length_m() > config_.max_length_m) return false;
    const auto variance = [](const PlanLine& line) {
        return kCorrelated * line.noise_m * line.noise_m / (line.points * line.spread_m * line.spread_m);
    };
    const double sd = std::sqrt(variance(turn.now) + variance(turn.before) + kFloor_rad * kFloor_rad);
    if (std::abs(turn.turn_rad) < std::max(config_.min_turn_rad, kSigmas * sd)) return false;
    if (std::abs(turn.turn_rad) > config_.max_turn_rad) return false;
    return turn.far_shift_m() > config_.min_shift_m;
}

}  // namespace dlod
