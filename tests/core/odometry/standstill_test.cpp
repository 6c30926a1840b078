#include "core/odometry/standstill.hpp"

#include <gtest/gtest.h>

#include "core/preprocess/subsampling.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod::test {
namespace {

DriveOptions sensor_options() {
    DriveOptions options;
    options.height = 64;
    options.width = 512;
    return options;
}

/// A drive, and what is told of its frames.
struct Watched {
    Watched(std::vector<SceneBox> scene, Trajectory trajectory)
        : drive(std::move(scene), std::move(trajectory), sensor_options()),
          frame(drive.sensor()),
          subsampling(drive.sensor(), SubsamplingConfig{}),
          standstill(drive.sensor()) {}

    bool see(int k, bool slow = true) {
        drive.fill(k, frame);
        subsampling.process(frame);
        return standstill.see(frame.prepared.points, slow);
    }

    SimulatedDrive drive;
    Frame frame;
    Subsampling subsampling;
    Standstill standstill;
};

Eigen::Isometry3d at(double x_m, double y_m = 0.0) {
    return Eigen::Isometry3d(Eigen::Translation3d(x_m, y_m, 0.0));
}

TEST(Standstill, IsSeenFromTheSecondScanOn) {
    Watched watched(furnished_room(), [](double) { return at(0.3, -0.2); });
    EXPECT_FALSE(watched.see(0));
    for (int k = 1; k < 40; ++k) EXPECT_TRUE(watched.see(k)) << k;
}

TEST(Standstill, IsSeenInNearlyAllScansWhoeverPassesBy) {
    std::vector<SceneBox> scene = furnished_room();
    scene.push_back({{-6.0, 2.0, -1.0}, {-5.5, 2.5, 0.8}, false, {1.2, 0.0, 0.0}});
    scene.push_back({{5.0, -3.0, -1.0}, {5.5, -2.5, 0.8}, false, {-1.0, 0.2, 0.0}});
    Watched watched(scene, [](double) { return at(0.3, -0.2); });
    int seen = 0;
    for (int k = 0; k < 40; ++k) seen += watched.see(k) ? 1 : 0;
    EXPECT_GE(seen, 35);
}

TEST(Standstill, EndsWithinMillimetresHoweverSlowlyTheSensorLeaves) {
    for (const double speed_mps : {0.005, 0.02, 0.1, 0.5, 2.0}) {
        const double leaves_s = 1.0;
        Watched watched(furnished_room(), [&](double t) { return at(speed_mps * std::max(0.0, t - leaves_s), 0.1); });
        int k = 0;
        for (; k < 10; ++k) watched.see(k);
        double way_m = 0.0;
        while (k < 40 && watched.see(k)) way_m = speed_mps * (watched.drive.stamp_s(k++) - leaves_s);
        EXPECT_LT(way_m, 0.005) << speed_mps;
        EXPECT_LT(k, 40) << speed_mps;
    }
}

TEST(Standstill, IsNoneOfASensorInMotion) {
    for (const double speed_mps : {0.1, 1.0, 5.0}) {
        Watched watched(furnished_room(), [&](double t) { return at(speed_mps * t - 2.0); });
        for (int k = 0; k < 8; ++k) EXPECT_FALSE(watched.see(k)) << speed_mps << ' ' << k;
    }
    Watched turning(furnished_room(),
                    [](double t) { return Eigen::Isometry3d(Eigen::AngleAxisd(0.05 * t, Eigen::Vector3d::UnitZ())); });
    for (int k = 0; k < 8; ++k) EXPECT_FALSE(turning.see(k)) << k;
}

TEST(Standstill, IsBelievedOnlyOfWhatIsSlow) {
    Watched watched(furnished_room(), [](double) { return at(0.0); });
    for (int k = 0; k < 5; ++k) EXPECT_FALSE(watched.see(k, false));
    EXPECT_TRUE(watched.see(5, true));
    // What is believed of the motion counts no more then.
    EXPECT_TRUE(watched.see(6, false));
}

// In a tunnel a sensor at speed sees the same again and again.
TEST(Standstill, IsNotToldWhereNothingFacesADirection) {
    Watched watched({{{-200, -3, -1.5}, {200, 3, 3.5}, true}}, [](double t) { return at(5.0 * t); });
    for (int k = 0; k < 8; ++k) EXPECT_FALSE(watched.see(k)) << k;
}

}  // namespace
}  // namespace dlod::test
