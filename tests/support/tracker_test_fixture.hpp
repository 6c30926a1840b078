// What the tests of the tracker have in common.
#pragma once

#include <gtest/gtest.h>

#include "core/tracking/tracker.hpp"
#include "tests/support/synthetic_frame.hpp"

namespace dlod::test {

class TrackerTest : public ::testing::Test {
  protected:
    TrackerTest() : sensor(small_sensor()), scene(sensor) {}

    Cylinder person(double x, double y) const {
        Cylinder c;
        c.foot_m = {x, y, -1.2};
        return c;
    }
    /// Something else, at a place in the sensor's frame.
    Cylinder body(const Eigen::Vector3d& foot_m, double radius_m, double height_m) const {
        Cylinder c;
        c.foot_m = foot_m;
        c.radius_m = radius_m;
        c.height_m = height_m;
        return c;
    }
    /// The published track nearest to a place in the ground plane, or nullptr when none is within a metre.
    const Track* track_at(double x, double y) const {
        const Track* best = nullptr;
        double distance = 1.0;
        for (const Track& t : scene.frame.detection.tracks) {
            const double d = (t.box.center_m.head<2>() - Eigen::Vector2d(x, y)).norm();
            if (d < distance) {
                distance = d;
                best = &t;
            }
        }
        return best;
    }

    SensorModel sensor;
    SyntheticFrame scene;
    TrackingConfig config;
};

}  // namespace dlod::test
