#include "core/evidence/turned_plates.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/evidence/detection.hpp"
#include "core/segmentation/ground_removal.hpp"
#include "core/segmentation/range_image_segmentation.hpp"
#include "tests/support/rendered_scene.hpp"

namespace dlod {
namespace {

const SensorModel kSensor = test::even_sensor(96, 512, 0.5, -0.7);
constexpr double kWidth_m = 0.9;
constexpr double kHeight_m = 2.0;
constexpr double kFrame_s = 0.1;

/// Range to an upright leaf without thickness that stands at an angle to the y axis.
double leaf_range(const Eigen::Vector2d& hinge, double angle_rad, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const Eigen::Vector3d along(std::sin(angle_rad), std::cos(angle_rad), 0.0);
    const Eigen::Vector3d normal(along.y(), -along.x(), 0.0);
    const Eigen::Vector3d axis(hinge.x(), hinge.y(), 0.0);
    const double speed = normal.dot(d);
    if (std::abs(speed) < 1e-9) return 0.0;
    const double range = normal.dot(axis - o) / speed;
    const Eigen::Vector3d p = o + range * d - axis;
    const bool inside =
        range > 0.0 && along.dot(p) > 0.0 && along.dot(p) < kWidth_m && p.z() > 0.0 && p.z() < kHeight_m;
    return inside ? range : 0.0;
}

/// A wall at x = 3 with a doorway from y = -0.3 to 0.6, its leaf, a room behind it, the ground.
double doorway_range(double angle_rad, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double range = test::plane_range(Eigen::Vector3d::UnitZ(), 0.0, o, d);
    range = test::nearest(range, test::box_range({3.0, -20.0, 0.0}, {3.1, -0.3, 2.6}, o, d));
    range = test::nearest(range, test::box_range({3.0, 0.6, 0.0}, {3.1, 20.0, 2.6}, o, d));
    range = test::nearest(range, test::box_range({3.0, -0.3, kHeight_m}, {3.1, 0.6, 2.6}, o, d));
    range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitX(), 7.0, o, d));
    return test::nearest(range, leaf_range({3.02, -0.3}, angle_rad, o, d));
}

class Replay {
  public:
    explicit Replay(const DetectionConfig& config = {})
        : frame(kSensor), ground_(kSensor, {}), segmentation_(kSensor, {}), detector_(kSensor, config) {}

    void step(const test::Scene& scene, double x_m) {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.translation() = Eigen::Vector3d(x_m, 0.0, 1.2);
        test::render(kSensor, scene, pose, frame);
        frame.header.stamp_ns = 1'000'000'000 + static_cast<std::int64_t>(1e9 * kFrame_s) *
                                                    static_cast<std::int64_t>(frame.header.sequence);
        ground_.process(frame);
        segmentation_.process(frame);
        detector_.process(frame);
        ++frame.header.sequence;
    }
    /// A leaf that is closed for half a second and then turns.
    void swing(double rate_radps, int frames, double speed_mps = 0.0) {
        for (int k = 0; k < frames; ++k) {
            const double angle_rad = rate_radps * kFrame_s * std::max(0, k - 5);
            step([&](const auto& o, const auto& d) { return doorway_range(angle_rad, o, d); },
                 speed_mps * kFrame_s * k);
        }
    }

    struct Counts {
        int leaf = 0, found = 0, hinge_side = 0, hinge_side_found = 0, wrong = 0;
    };
    /// Pixels of the leaf above the ground, and of those with more free than occupied points.
    Counts counts(double angle_rad) const {
        Image<std::uint8_t> moving(kSensor.height, kSensor.width, 0);
        for (const Detection& detection : frame.detection.detections) {
            for (std::uint32_t i = 0; i < detection.count; ++i) {
                if (detection.free_points > detection.occupied_points)
                    moving[frame.detection.pixels[detection.first + i]] = 1;
            }
        }
        Counts counts;
        const Eigen::Vector2d along(std::sin(angle_rad), std::cos(angle_rad));
        for (PixelIndex p = 0; p < kSensor.pixels(); ++p) {
            if (frame.cloud.range_m[p] == 0.0F || frame.prepared.ground[p] != 0) continue;
            const Eigen::Vector3d world =
                frame.odometry.T_world_sensor *
                Eigen::Vector3d(frame.odometry.x[p], frame.odometry.y[p], frame.odometry.z[p]);
            const Eigen::Vector2d q = world.head<2>() - Eigen::Vector2d(3.02, -0.3);
            const double at = along.dot(q);
            const double off = std::abs(along.y() * q.x() - along.x() * q.y());
            const bool leaf = off < 0.005 && at > 0.0 && at < kWidth_m && world.z() < kHeight_m - 0.02;
            counts.leaf += leaf ? 1 : 0;
            counts.found += leaf && moving[p] != 0 ? 1 : 0;
            counts.hinge_side += leaf && at < 0.3 ? 1 : 0;
            counts.hinge_side_found += leaf && at < 0.3 && moving[p] != 0 ? 1 : 0;
            counts.wrong += !leaf && moving[p] != 0 ? 1 : 0;
        }
        return counts;
    }

    Frame frame;

  private:
    GroundRemoval ground_;
    RangeImageSegmentation segmentation_;
    Detector detector_;
};

TEST(TurnedPlates, LeafThatSwingsAwayIsFoundToItsHingeBeforeOneCanSeePastIt) {
    Replay run;
    run.swing(0.8, 8);  // two frames of motion: 14 cm at the free end
    const Replay::Counts c = run.counts(0.16);
    ASSERT_GT(c.leaf, 500);
    EXPECT_GT(c.found, 0.85 * c.leaf);
    EXPECT_GT(c.hinge_side_found, 0.7 * c.hinge_side);
    EXPECT_LT(c.wrong, 0.1 * c.leaf);
}

TEST(TurnedPlates, LeafThatSwingsNearerIsFoundToItsHinge) {
    Replay run;
    run.swing(-0.8, 9, 0.5);
    const Replay::Counts c = run.counts(-0.24);
    ASSERT_GT(c.leaf, 500);
    EXPECT_GT(c.found, 0.85 * c.leaf);
    EXPECT_GT(c.hinge_side_found, 0.7 * c.hinge_side);
    EXPECT_LT(c.wrong, 0.1 * c.leaf);
}

TEST(TurnedPlates, WithoutThemTheHingeSideIsMissed) {
    DetectionConfig config;
    config.use_plates = false;
    Replay run(config);
    run.swing(0.8, 8);
    const Replay::Counts c = run.counts(0.16);
    EXPECT_LT(c.hinge_side_found, 0.1 * c.hinge_side);
}

TEST(TurnedPlates, ClosedDoorsAndWallsDoNotTurnForARobotThatDrivesPast) {
    Replay run;
    int moving = 0;
    for (int k = 0; k < 14; ++k) {
        run.step([&](const auto& o, const auto& d) { return doorway_range(0.6, o, d); }, 0.15 * k);
        const Replay::Counts c = run.counts(0.6);
        moving += c.found + c.wrong;
    }
    EXPECT_EQ(moving, 0);
}

TEST(TurnedPlates, WallBehindAPersonWhoPassesDoesNotTurn) {
    Replay run;
    for (int k = 0; k < 14; ++k) {
        const Eigen::Vector3d feet(2.6, 1.0 - 0.14 * k, 0.0);
        run.step(
            [&](const auto& o, const auto& d) {
                return test::nearest(doorway_range(0.0, o, d),
                                     test::box_range(feet + Eigen::Vector3d(-0.2, -0.2, 0.0),
                                                     feet + Eigen::Vector3d(0.2, 0.2, 1.7), o, d));
            },
            0.0);
        int wall = 0;
        for (const Detection& detection : run.frame.detection.detections) {
            if (detection.free_points <= detection.occupied_points) continue;
            for (std::uint32_t i = 0; i < detection.count; ++i)
                wall += run.frame.odometry.x[run.frame.detection.pixels[detection.first + i]] > 2.9F ? 1 : 0;
        }
        EXPECT_LE(wall, 10) << k;
    }
}

}  // namespace
}  // namespace dlod
