#include "core/odometry/usual_quality.hpp"

namespace dlod {
namespace {

constexpr double kPoorShare = 0.6;
constexpr double kPoorFit = 0.2;
// What it takes to be as usual again.
constexpr double kUsualFit = 0.4;
// Of two registrations one is better with so many times more matches near their planes.
constexpr double kClearlyBetter = 1.2;
constexpr double kSmoothing = 0.2;

}  // namespace

bool UsualQuality::lacks_matches(const MatchQuality& quality) const {
    return quality.near < kPoorShare * usual_.near;
}

bool UsualQuality::lacks_fit(const MatchQuality& quality) const {
    return quality.fit < kPoorFit * usual_.fit;
}

bool UsualQuality::is_better(const MatchQuality& first, const MatchQuality& second, bool judges_fit) const {
    return second.near > kClearlyBetter * first.near ||
           (judges_fit && lacks_fit(first) && second.fit > kUsualFit * usual_.fit);
}

void UsualQuality::see(const MatchQuality& quality) {
    usual_.near += kSmoothing * (quality.near - usual_.near);
    usual_.fit += kSmoothing * (quality.fit - usual_.fit);
}

}  // namespace dlod
