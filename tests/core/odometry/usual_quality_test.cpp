#include "core/odometry/usual_quality.hpp"

#include <gtest/gtest.h>

namespace dlod::test {
namespace {

UsualQuality after_many(const MatchQuality& quality) {
    UsualQuality usual;
    for (int i = 0; i < 50; ++i) usual.see(quality);
    return usual;
}

TEST(UsualQuality, AtFirstNothingIsPoor) {
    const UsualQuality usual;
    EXPECT_FALSE(usual.lacks_matches({10.0, 1.0}));
    EXPECT_FALSE(usual.lacks_fit({10.0, 1.0}));
}

TEST(UsualQuality, MatchesAndFitAreJudgedApart) {
    const UsualQuality usual = after_many({1000.0, 300.0});
    EXPECT_TRUE(usual.lacks_matches({500.0, 300.0}));
    EXPECT_FALSE(usual.lacks_fit({500.0, 300.0}));
    // In a street the ground goes on matching where the facades do not.
    EXPECT_FALSE(usual.lacks_matches({900.0, 20.0}));
    EXPECT_TRUE(usual.lacks_fit({900.0, 20.0}));
}

TEST(UsualQuality, AnotherRegistrationIsBetterWhereItIsAsUsualAgain) {
    const UsualQuality usual = after_many({1000.0, 300.0});
    EXPECT_TRUE(usual.is_better({500.0, 100.0}, {900.0, 100.0}, false));
    EXPECT_FALSE(usual.is_better({900.0, 100.0}, {950.0, 290.0}, true));
    EXPECT_TRUE(usual.is_better({900.0, 20.0}, {950.0, 290.0}, true));
    EXPECT_FALSE(usual.is_better({900.0, 20.0}, {950.0, 290.0}, false));
    EXPECT_FALSE(usual.is_better({900.0, 20.0}, {950.0, 50.0}, true));
}

}  // namespace
}  // namespace dlod::test
