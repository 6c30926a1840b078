#include "core/segmentation/ground_removal.hpp"

#include <gtest/gtest.h>

#include "tests/support/rendered_scene.hpp"

namespace dlod {
namespace {

using test::Scene;

const SensorModel kSensor = test::even_sensor(128, 512, 0.78, -0.78);

struct Counts {
    int ground = 0, ground_found = 0, other = 0, other_taken = 0;
};

/// Renders both scenes (the ground alone, everything) and counts what was taken for ground.
Counts count(const Scene& ground, const Scene& objects, const Eigen::Isometry3d& pose, bool with_imu = false) {
    Frame frame(kSensor);
    test::render(
        kSensor, [&](const auto& o, const auto& d) { return test::nearest(ground(o, d), objects(o, d)); }, pose, frame);
    if (with_imu) {
        ImuSample sample;
        sample.acceleration_mps2 = (pose.linear().transpose() * Eigen::Vector3d(0.0, 0.0, 9.81)).cast<float>();
        frame.imu.push_back(sample);
    }
    GroundRemoval removal(kSensor, {});
    removal.process(frame);
    Counts counts;
    for (int r = 0; r < kSensor.height; ++r) {
        for (int c = 0; c < kSensor.width; ++c) {
            const double range = static_cast<double>(frame.cloud.range_m(r, c));
            if (range <= 0.0 || range > 25.0) continue;
            const Eigen::Vector3d d = pose.linear() * test::beam(kSensor, r, c);
            const double to_ground = ground(pose.translation(), d);
            if (to_ground > 0.0 && std::abs(range - to_ground) < 1e-3) {
                ++counts.ground;
                counts.ground_found += frame.prepared.ground(r, c);
            } else {
                ++counts.other;
                counts.other_taken += frame.prepared.ground(r, c);
            }
        }
    }
    return counts;
}

Eigen::Isometry3d at_height(double height_m, double pitch_rad = 0.0) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation().z() = height_m;
    pose.linear() = Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d(1.0, 1.0, 0.0).normalized()).toRotationMatrix();
    return pose;
}

const Scene kNothing = [](const auto&, const auto&) { return 0.0; };
const Scene kFlat = [](const auto& o, const auto& d) { return test::plane_range(Eigen::Vector3d::UnitZ(), 0.0, o, d); };
/// Walls of a corridor 3 m wide, its ceiling at 2.6 m, and a person.
const Scene kCorridor = [](const auto& o, const auto& d) {
    const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
    double range = test::nearest(test::plane_range(y, 1.5, o, d), test::plane_range(y, -1.5, o, d));
    range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitZ(), 2.6, o, d));
    return test::nearest(range, test::box_range({4.0, 0.2, 0.0}, {4.3, 0.7, 1.75}, o, d));
};

class Mounted : public testing::TestWithParam<double> {};

TEST_P(Mounted, FlatGroundIsFoundAtEveryHeight) {
    const Counts counts = count(kFlat, kNothing, at_height(GetParam()));
    EXPECT_GT(counts.ground, 10000);
    EXPECT_GE(counts.ground_found, 0.99 * counts.ground);
}

TEST_P(Mounted, WallsCeilingAndPersonStay) {
    const Counts counts = count(kFlat, kCorridor, at_height(GetParam()));
    EXPECT_GE(counts.ground_found, 0.98 * counts.ground);
    EXPECT_LE(counts.other_taken, 0.03 * counts.other);
}

INSTANTIATE_TEST_SUITE_P(Heights, Mounted, testing::Values(0.5, 1.2, 2.4));

TEST(GroundRemoval, TiltedSensorFollowsTheImu) {
    const Counts counts = count(kFlat, kCorridor, at_height(1.2, 0.3), true);
    EXPECT_GE(counts.ground_found, 0.97 * counts.ground);
    EXPECT_LE(counts.other_taken, 0.03 * counts.other);
}

TEST(GroundRemoval, BrakingDoesNotTiltTheGround) {
    Frame frame(kSensor);
    test::render(kSensor, kFlat, at_height(1.2), frame);
    GroundRemoval removal(kSensor, {});
    for (int k = 0; k < 20; ++k) {
        ImuSample sample;
        sample.acceleration_mps2 = Eigen::Vector3f(k < 5 ? 0.0F : -3.0F, 0.0F, 9.81F);
        frame.imu.assign(1, sample);
        removal.process(frame);
        EXPECT_GT(removal.up().z(), std::cos(0.02F)) << k;
    }
}

TEST(GroundRemoval, RampAndKerbAreGround) {
    const double slope = std::tan(0.12);
    const Scene ramp = [slope](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        const double flat = test::plane_range(Eigen::Vector3d::UnitZ(), 0.0, o, d);
        // Rises beyond x = 4 m.
        const double rising = test::plane_range(Eigen::Vector3d(-slope, 0.0, 1.0), -4.0 * slope, o, d);
        if (rising > 0.0 && (o + rising * d).x() > 4.0) return test::nearest(rising, flat);
        return flat;
    };
    const Counts on_ramp = count(ramp, kNothing, at_height(1.2));
    EXPECT_GE(on_ramp.ground_found, 0.97 * on_ramp.ground);

    const Scene kerb = [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        const double flat = test::plane_range(Eigen::Vector3d::UnitZ(), 0.0, o, d);
        return test::nearest(flat, test::box_range({-50.0, 3.0, -1.0}, {50.0, 60.0, 0.12}, o, d));
    };
    const Counts on_kerb = count(kerb, kNothing, at_height(1.2));
    EXPECT_GE(on_kerb.ground_found, 0.93 * on_kerb.ground);
}

TEST(GroundRemoval, EmptyFrameHasNoGround) {
    Frame frame(kSensor);
    frame.prepared.ground.fill(1);
    GroundRemoval removal(kSensor, {});
    removal.process(frame);
    for (std::size_t i = 0; i < frame.prepared.ground.size(); ++i) ASSERT_EQ(frame.prepared.ground[i], 0);
}

}  // namespace
}  // namespace dlod
