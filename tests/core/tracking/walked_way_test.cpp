#include "core/tracking/walked_way.hpp"

#include <gtest/gtest.h>

namespace dlod {
namespace {

struct Walk {
    Eigen::Vector2d speed_mps = {1.3, 0.0};   ///< of the thing
    Eigen::Vector2d track_mps = {1.3, 0.0};   ///< its track's
    Eigen::Vector2d sensor_mps = {0.0, 0.0};  ///< of the sensor
    Eigen::Vector2d size_m = {0.5, 0.5};
    int missed_every = 0;  ///< four frames in a row after so many
    bool whole = true;
};

/// Whether it has walked after two and a half seconds.
bool has_walked(const Walk& walk) {
    WalkedWay way;
    bool walked = false;
    for (int k = 0; k < 25; ++k) {
        if (walk.missed_every > 0 && k % (walk.missed_every + 4) >= walk.missed_every) continue;
        const double t = 0.1 * k;
        WholeSight sight;
        sight.visible.size_m = {walk.size_m.x(), walk.size_m.y(), 1.6};
        sight.visible.center_m.head<2>() = Eigen::Vector2d(16.0, 3.0) + t * walk.speed_mps;
        sight.sensor_m = t * walk.sensor_mps;
        sight.time_s = t;
        walked = way.update(sight, walk.whole, walk.track_mps);
    }
    return walked;
}

TEST(WalkedWay, IsSeenOfAWalker) {
    EXPECT_TRUE(has_walked({}));
    EXPECT_TRUE(has_walked({.sensor_mps = {5.0, 0.0}}));
}

TEST(WalkedWay, IsNoneOfWhatRests) {
    EXPECT_FALSE(has_walked({.speed_mps = {0.0, 0.0}, .track_mps = {0.0, 0.0}}));
    EXPECT_FALSE(has_walked({.speed_mps = {0.2, 0.0}, .track_mps = {0.2, 0.0}})) << "less than its own size";
}

TEST(WalkedWay, IsNoneOfAPatternThatMovesWithTheSensor) {
    EXPECT_FALSE(has_walked({.sensor_mps = {1.4, 0.1}}));
}

TEST(WalkedWay, IsNoneWhereTheTrackIsAtAnotherVelocity) {
    EXPECT_FALSE(has_walked({.track_mps = {0.0, 1.3}}));
}

TEST(WalkedWay, IsNoneOfWhatIsHiddenLargeOrOftenMissed) {
    EXPECT_FALSE(has_walked({.whole = false}));
    EXPECT_FALSE(has_walked({.size_m = {3.0, 0.3}}));
    EXPECT_FALSE(has_walked({.missed_every = 3}));
}

}  // namespace
}  // namespace dlod
