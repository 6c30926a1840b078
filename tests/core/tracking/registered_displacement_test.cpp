#include "core/tracking/registered_displacement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/synthetic_frame.hpp"

namespace dlod {
namespace {

/// Range of what is seen in a direction (azimuth, elevation), or 0.
using Surface = std::function<double(double azimuth_rad, double elevation_rad)>;

/// Sees a surface with every pixel from a place in the world; pixels that see something belong to the object.
PointSample see(const Surface& surface, const Eigen::Vector3d& from = Eigen::Vector3d::Zero()) {
    const SensorModel sensor = test::small_sensor();
    Frame frame(sensor);
    frame.odometry.T_world_sensor.translation() = from;
    std::vector<PixelIndex> pixels;
    for (int r = 0; r < sensor.height; ++r) {
        for (int c = 0; c < sensor.width; ++c) {
            // A narrow, fine window ahead.
            const double azimuth = 0.5 - c / 256.0, elevation = 0.2 - 0.4 * r / 31.0;
            const double range = surface(azimuth, elevation);
            if (range <= 0.0) continue;
            const auto i = static_cast<PixelIndex>(r * sensor.width + c);
            frame.odometry.x[i] = static_cast<float>(range * std::cos(elevation) * std::cos(azimuth));
            frame.odometry.y[i] = static_cast<float>(range * std::cos(elevation) * std::sin(azimuth));
            frame.odometry.z[i] = static_cast<float>(range * std::sin(elevation));
            pixels.push_back(i);
        }
    }
    PointSample sample;
    sample_points(frame, pixels, sample);
    return sample;
}

/// A pillar at (x, y) seen from the origin of the axes.
Surface pillar(double x, double y, double radius = 0.25) {
    return [=](double azimuth, double elevation) {
        const Eigen::Vector2d direction(std::cos(azimuth), std::sin(azimuth)), middle(x, y);
        const double along = direction.dot(middle);
        const double off2 = middle.squaredNorm() - along * along;
        return off2 < radius * radius ? (along - std::sqrt(radius * radius - off2)) / std::cos(elevation) : 0.0;
    };
}

/// The part of a wall at distance x that an opening from y0 to y1 shows.
Surface wall_strip(double x, double y0, double y1) {
    return [=](double azimuth, double elevation) {
        const double y = x * std::tan(azimuth);
        return y > y0 && y < y1 ? x / std::cos(azimuth) / std::cos(elevation) : 0.0;
    };
}

TEST(RegisteredDisplacement, MeasuresTheStepOfAWalker) {
    for (const Eigen::Vector2d& step :
         {Eigen::Vector2d(0.15, 0.0), Eigen::Vector2d(0.0, 0.35), Eigen::Vector2d(-0.2, 0.25)}) {
        const auto r = register_displacement(see(pillar(5.0, 0.0)), see(pillar(5.0 + step.x(), step.y())), step);
        EXPECT_LT((r.displacement_m - step).norm(), 0.06);
        EXPECT_GT(displacement_log_odds(r, 0.2), 1.0);
    }
}

TEST(RegisteredDisplacement, WhatStaysSpeaksAgainstMotion) {
    const auto r = register_displacement(see(pillar(5.0, 0.0)), see(pillar(5.01, -0.01)), {0.1, 0.0});
    EXPECT_LT(displacement_log_odds(r, 0.5), 0.0);
    EXPECT_EQ(displacement_log_odds(r, 0.1), 0.0);  // within one frame a slow motion would not show
}

// The failure case of the paper: as the robot passes an opening, the segment of wall behind it seems to move.
TEST(RegisteredDisplacement, AWallSeenThroughAnOpeningDoesNotMove) {
    const auto r = register_displacement(see(wall_strip(6.0, -1.0, 0.0)), see(wall_strip(6.0, -0.4, 0.6)), {0.0, 0.6});
    EXPECT_LE(displacement_log_odds(r, 0.5), 0.0);
    EXPECT_LT(r.observable, 0.05);
}

// As the robot passes a parked thing its other side comes into view: the box changes, the points do not move.
TEST(RegisteredDisplacement, ASideThatComesIntoViewIsNoMotion) {
    const auto box = [](double from_y) {
        // Corner at (5, 0): a front along -y and a side along +x that shows only from beyond the corner.
        return [from_y](double azimuth, double elevation) {
            const Eigen::Vector2d d(std::cos(azimuth), std::sin(azimuth));
            const double front = 5.0 / d.x();
            const double y_front = from_y + front * d.y();
            if (y_front < 0.0 && y_front > -1.2) return front / std::cos(elevation);
            if (from_y > 0.0 && d.y() < 0.0) {
                const double side = -from_y / d.y();
                const double x_side = side * d.x();
                if (x_side > 5.0 && x_side < 6.5) return side / std::cos(elevation);
            }
            return 0.0;
        };
    };
    const PointSample before = see(box(-0.5), {0.0, -0.5, 0.0});
    const PointSample now = see(box(1.5), {0.0, 1.5, 0.0});
    const auto r = register_displacement(before, now, {0.3, 0.3});
    EXPECT_LT(displacement_log_odds(r, 1.0), 0.5);
}

TEST(RegisteredDisplacement, WhatStandsLiesWhereItWasAndItsMiddleDoes) {
    const auto registered = [](const Surface& before, const Surface& now) {
        return register_displacement(see(before), see(now), Eigen::Vector2d::Zero());
    };
    const auto stayed = registered(pillar(5.0, 0.0), pillar(5.01, -0.01));
    EXPECT_GT(stayed.in_place_every_way, 0.9);
    EXPECT_TRUE(stands(stayed, 0.5, 0.3, 0.02));
    EXPECT_FALSE(stands(stayed, 0.5, 0.3, 0.4));
    EXPECT_FALSE(stands(stayed, 0.1, 0.3, 0.0));  // so slow a motion would not show yet
    EXPECT_FALSE(stands(registered(pillar(5.0, 0.0), pillar(5.0, 0.25)), 0.5, 0.3, 0.02));
    // A pane stands where what it shows does; a bus that passes lies in its own plane, too.
    const auto pane = registered(wall_strip(6.0, -1.0, 0.0), wall_strip(6.0, -0.9, 0.1));
    EXPECT_LT(pane.in_place_every_way, 0.5);
    EXPECT_TRUE(stands(pane, 0.5, 0.3, 0.1));
    EXPECT_FALSE(stands(pane, 0.5, 0.3, 2.0));
    // A part of it shows something behind it now: the rest has stayed.
    const auto through = registered(pillar(5.0, 0.0), [](double azimuth, double elevation) {
        return pillar(elevation > 0.14 ? 5.5 : 5.0, 0.0)(azimuth, elevation);
    });
    EXPECT_LT(through.in_place, 0.8);
    EXPECT_TRUE(stands(through, 0.5, 0.3, 0.02));
}

TEST(RegisteredDisplacement, TooFewPointsSayNothing) {
    PointSample few = see(pillar(5.0, 0.0));
    few.size = 5;
    const auto r = register_displacement(few, see(pillar(6.0, 0.0)), {1.0, 0.0});
    EXPECT_EQ(displacement_log_odds(r, 1.0), 0.0);
}

TEST(RegisteredDisplacement, WhatIsPassedByCloselyShowsAnotherSide) {
    PointSample before, now;
    now.origin_m = {2.0, 0.0, 1.0};
    EXPECT_TRUE(show_same_side(before, now, {20.0, 5.0}));    // far ahead
    EXPECT_TRUE(show_same_side(before, now, {1.0, 5.0}));     // 23 degrees
    EXPECT_FALSE(show_same_side(before, now, {1.0, 1.5}));    // 67 degrees
    EXPECT_TRUE(show_same_side(before, before, {0.5, 0.5}));  // of a robot that stands
}

}  // namespace
}  // namespace dlod
