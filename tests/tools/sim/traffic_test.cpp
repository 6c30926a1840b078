#include "tools/sim/traffic.hpp"

#include <gtest/gtest.h>

namespace dlod::tools::sim {
namespace {

TEST(Traffic, VehiclesStopAtTheLightKeepTheirDistanceAndGoOn) {
    const ArcPath lane({Vec2(0, 0), Vec2(200, 0)}, false, 10.0);
    const std::vector<Driver> drivers{{.s_m = 40.0, .speed_mps = 10.0}, {.s_m = 25.0, .speed_mps = 10.0}};
    const auto motions = drive_lane(lane, drivers, {{.s_m = 80.0, .closed_s = {{0.0, 12.0}}}}, 20.0);
    for (double t = 0.0; t < 12.0; t += 0.1) {
        const double first = motions[0](t).x();
        const double second = motions[1](t).x();
        EXPECT_LT(first + 0.5 * 4.5, 80.5) << "over the line at " << t;
        EXPECT_GT(first - second, 4.5 + 0.5) << "bumper to bumper at " << t;
    }
    EXPECT_LT(motions[0].derivative(11.5).x(), 0.05);
    EXPECT_GT(motions[0].derivative(17.0).x(), 3.0);
    EXPECT_GT(motions[1](20.0).x(), 75.0);
}

}  // namespace
}  // namespace dlod::tools::sim
