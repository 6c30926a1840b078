#include "core/evidence/detection.hpp"

#include <gtest/gtest.h>

#include <set>

#include "core/segmentation/ground_removal.hpp"
#include "core/segmentation/range_image_segmentation.hpp"
#include "tests/support/rendered_scene.hpp"

namespace dlod {
namespace {

using test::Scene;

const SensorModel kSensor = test::even_sensor(96, 512, 0.5, -0.7);

/// Ground, and whatever else.
double ground_range(const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    return test::plane_range(Eigen::Vector3d::UnitZ(), 0.0, o, d);
}

Eigen::Isometry3d at(double x, double y, double yaw_rad = 0.0) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(x, y, 1.2);
    pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return pose;
}

/// A person: a box 0.4 m wide, 1.7 m tall, with a foot of 8 cm that sticks out towards the sensor.
double person_range(const Eigen::Vector3d& feet, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const double body =
        test::box_range(feet + Eigen::Vector3d(-0.2, -0.2, 0.0), feet + Eigen::Vector3d(0.2, 0.2, 1.7), o, d);
    const double foot =
        test::box_range(feet + Eigen::Vector3d(-0.35, -0.1, 0.0), feet + Eigen::Vector3d(0.2, 0.1, 0.08), o, d);
    return test::nearest(body, foot);
}

/// Runs preparation and detection over frames whose scene and pose depend on the frame's number.
class Replay {
  public:
    explicit Replay(const DetectionConfig& config = {})
        : ground_(kSensor, {}), segmentation_(kSensor, {}), detector_(kSensor, config), frame(kSensor) {}

    void step(const Scene& scene, const Eigen::Isometry3d& pose) {
        test::render(kSensor, scene, pose, frame);
        frame.header.stamp_ns = 1'000'000'000 + 100'000'000 * static_cast<std::int64_t>(frame.header.sequence);
        ground_.process(frame);
        segmentation_.process(frame);
        detector_.process(frame);
        ++frame.header.sequence;
    }

    /// The detection that covers most of the pixels for which `inside` holds of the world point.
    const Detection* covering(const std::function<bool(const Eigen::Vector3d&)>& inside) const {
        const Detection* best = nullptr;
        int most = 0;
        for (const Detection& detection : frame.detection.detections) {
            int n = 0;
            for (std::uint32_t i = 0; i < detection.count; ++i)
                n += inside(world(frame.detection.pixels[detection.first + i])) ? 1 : 0;
            if (n > most) {
                most = n;
                best = &detection;
            }
        }
        return best;
    }
    Eigen::Vector3d world(PixelIndex p) const {
        return frame.odometry.T_world_sensor *
               Eigen::Vector3d(frame.odometry.x[p], frame.odometry.y[p], frame.odometry.z[p]);
    }
    int free_points() const {
        int n = 0;
        for (const Detection& detection : frame.detection.detections) n += detection.free_points;
        return n;
    }

  private:
    GroundRemoval ground_;
    RangeImageSegmentation segmentation_;
    Detector detector_;

  public:
    Frame frame;
};

Scene room_with(const std::function<double(const Eigen::Vector3d&, const Eigen::Vector3d&)>& object) {
    return [object](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        double range = ground_range(o, d);
        range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitX(), 12.0, o, d));
        range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitX(), -12.0, o, d));
        range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitY(), 12.0, o, d));
        range = test::nearest(range, test::plane_range(Eigen::Vector3d::UnitY(), -12.0, o, d));
        return test::nearest(range, object(o, d));
    };
}

bool near_person(const Eigen::Vector3d& feet, const Eigen::Vector3d& p) {
    return (p - feet).head<2>().norm() < 0.5 && p.z() > 0.04 && p.z() < 1.8;
}

TEST(Detector, WalkingPersonIsFreeEvidenceFeetIncluded) {
    Replay run;
    Eigen::Vector3d feet;
    for (int k = 0; k < 10; ++k) {
        feet = Eigen::Vector3d(6.0, -2.0 + 0.14 * k, 0.0);
        run.step(room_with([&](const auto& o, const auto& d) { return person_range(feet, o, d); }),
                 at(0.05 * k, 0.0, 0.02 * k));
    }
    const Detection* person = run.covering([&](const auto& p) { return near_person(feet, p); });
    ASSERT_NE(person, nullptr);
    EXPECT_GT(person->free_points, 30);
    EXPECT_GT(person->free_points, 5 * person->occupied_points);
    // Every pixel of the person that stands out of the ground is covered, and hardly anything else.
    std::set<PixelIndex> mask(run.frame.detection.pixels.begin() + person->first,
                              run.frame.detection.pixels.begin() + person->first + person->count);
    int own = 0;
    int found = 0;
    for (PixelIndex p = 0; p < kSensor.pixels(); ++p) {
        if (run.frame.cloud.range_m[p] == 0.0F || !near_person(feet, run.world(p))) continue;
        ++own;
        found += mask.count(p) != 0 ? 1 : 0;
    }
    EXPECT_GE(found, 0.97 * own);
    EXPECT_LE(static_cast<int>(mask.size()), 1.03 * own + 5);
}

TEST(Detector, NothingMovesNothingIsFree) {
    Replay run;
    const Scene scene = room_with([](const auto& o, const auto& d) {
        double range = person_range({5.0, 1.0, 0.0}, o, d);
        range = test::nearest(range, test::box_range({3.0, -4.0, 0.0}, {3.1, -3.9, 2.5}, o, d));
        return test::nearest(range, test::box_range({-6.0, -5.0, 0.0}, {-4.0, -4.0, 1.0}, o, d));
    });
    int free = 0;
    for (int k = 0; k < 30; ++k) {
        run.step(scene, at(0.1 * k, 0.03 * k, 0.05 * k));
        free += run.free_points();
    }
    EXPECT_LE(free, 5);
}

/// The robot passes a doorway: the room behind comes into view, unknown but not moving.
TEST(Detector, NewViewThroughADoorwayIsUnknown) {
    Replay run;
    const Scene scene = [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
        double range = ground_range(o, d);
        // A wall at y = 2 with a door from x = 3 to x = 4, a far wall behind it and a cupboard in the room.
        range = test::nearest(range, test::box_range({-20.0, 2.0, 0.0}, {3.0, 2.1, 3.0}, o, d));
        range = test::nearest(range, test::box_range({4.0, 2.0, 0.0}, {20.0, 2.1, 3.0}, o, d));
        range = test::nearest(range, test::box_range({-20.0, 8.0, 0.0}, {20.0, 8.1, 3.0}, o, d));
        range = test::nearest(range, test::box_range({4.5, 5.0, 0.0}, {5.0, 5.5, 1.8}, o, d));
        return test::nearest(range, test::plane_range(Eigen::Vector3d::UnitY(), -3.0, o, d));
    };
    int free = 0;
    for (int k = 0; k < 40; ++k) {
        run.step(scene, at(0.12 * k, 0.0));
        free += run.free_points();
    }
    EXPECT_LE(free, 5);
}

TEST(Detector, PersonAgainstAWallIsSingledOut) {
    Replay run;
    Eigen::Vector3d feet;
    for (int k = 0; k < 16; ++k) {
        // Walks along the wall at x = 6, touching it: one segment with the wall.
        feet = Eigen::Vector3d(5.8, -1.5 + 0.13 * k, 0.0);
        run.step(
            [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
                const double wall = test::plane_range(Eigen::Vector3d::UnitX(), 6.0, o, d);
                const double body = test::box_range(feet + Eigen::Vector3d(-0.2, -0.2, 0.0),
                                                    feet + Eigen::Vector3d(0.3, 0.2, 1.7), o, d);
                return test::nearest(test::nearest(ground_range(o, d), wall), body);
            },
            at(0.0, 0.0));
    }
    const Detection* person = run.covering([&](const auto& p) { return near_person(feet, p) && p.x() < 5.7; });
    ASSERT_NE(person, nullptr);
    int own = 0;
    for (std::uint32_t i = 0; i < person->count; ++i) {
        const Eigen::Vector3d p = run.world(run.frame.detection.pixels[person->first + i]);
        own += (p - feet).head<2>().norm() < 0.6 ? 1 : 0;
    }
    EXPECT_GT(person->free_points, person->occupied_points);
    EXPECT_GE(own, 0.9 * person->count);
}

// One segment, most of which is the parked car: around the other one's free places far more pixels are tested.
TEST(Detector, AParkedCarThatOneWhichDrivesTouchesIsNoPartOfIt) {
    Replay run;
    constexpr double kTouches_m = 2.05;
    for (int k = 0; k < 14; ++k) {
        const double rear_m = kTouches_m + 0.6 * (13 - k);
        run.step(room_with([&](const auto& o, const auto& d) {
                     const double parked = test::box_range({6.0, -2.0, 0.1}, {7.8, 2.0, 1.5}, o, d);
                     const double driving = test::box_range({6.0, rear_m, 0.1}, {7.8, rear_m + 2.0, 1.5}, o, d);
                     return test::nearest(parked, driving);
                 }),
                 at(0.0, 0.0));
    }
    const auto inside = [](double from_m, double to_m) {
        return [=](const Eigen::Vector3d& p) { return p.x() < 8.0 && p.y() > from_m && p.y() < to_m && p.z() > 0.2; };
    };
    const Detection* parked = run.covering(inside(-2.0, 1.8));
    const Detection* driving = run.covering(inside(2.3, 4.5));
    ASSERT_NE(parked, nullptr);
    ASSERT_NE(driving, nullptr);
    EXPECT_EQ(parked->segment, driving->segment);
    EXPECT_NE(parked, driving);
    EXPECT_GT(driving->free_points, 10 * driving->occupied_points);
    EXPECT_GT(parked->occupied_points, 5 * parked->free_points);
}

/// The same person and robot, turned so that the person crosses the image's seam.
TEST(Detector, SeamMakesNoDifference) {
    const auto walk = [](double yaw_rad) {
        Replay run;
        Eigen::Vector3d feet;
        const Eigen::Isometry3d turn = at(0.0, 0.0, yaw_rad);
        for (int k = 0; k < 8; ++k) {
            feet = Eigen::Vector3d(6.0, -0.5 + 0.14 * k, 0.0);
            run.step(room_with([&](const auto& o, const auto& d) { return person_range(feet, o, d); }), turn);
        }
        const Detection* person = run.covering([&](const auto& p) { return near_person(feet, p); });
        return person != nullptr ? std::array<int, 2>{static_cast<int>(person->count), person->free_points}
                                 : std::array<int, 2>{};
    };
    const auto plain = walk(0.5);
    ASSERT_GT(plain[1], 20);
    // The image's first column looks backwards or forwards, depending on the lidar's mounting: try both.
    for (const double yaw : {0.0, std::numbers::pi}) {
        const auto seam = walk(yaw);
        EXPECT_NEAR(seam[0], plain[0], 0.15 * plain[0]);
        EXPECT_GT(seam[1], 0.7 * plain[1]);
    }
}

TEST(Detector, CuesCanBeSwitchedOff) {
    DetectionConfig config;
    config.use_free_space = false;
    config.use_residual = false;
    Replay run(config);
    for (int k = 0; k < 6; ++k) {
        const Eigen::Vector3d feet(6.0, 0.2 * k, 0.0);
        run.step(room_with([&](const auto& o, const auto& d) { return person_range(feet, o, d); }), at(0.0, 0.0));
    }
    EXPECT_FALSE(run.frame.detection.detections.empty());
    for (const Detection& detection : run.frame.detection.detections) {
        EXPECT_EQ(detection.free_points + detection.occupied_points + detection.unknown_points, 0);
        EXPECT_EQ(detection.residual_points, 0);
    }
}

TEST(Detector, NearerSurfacesBesideMarkOcclusion) {
    Replay run;
    const Eigen::Vector3d feet(8.0, 0.0, 0.0);
    // A pole in front of the person's right side, seen from the sensor: columns run clockwise.
    run.step(
        room_with([&](const auto& o, const auto& d) {
            return test::nearest(person_range(feet, o, d), test::box_range({4.0, -0.5, 0.0}, {4.1, -0.02, 2.5}, o, d));
        }),
        at(0.0, 0.0));
    const Detection* person = run.covering([&](const auto& p) { return near_person(feet, p); });
    ASSERT_NE(person, nullptr);
    EXPECT_TRUE(person->occluded_right);
    EXPECT_FALSE(person->occluded_left);
}

TEST(Detector, InvalidPoseGivesNoDetections) {
    Replay run;
    run.step(room_with([](const auto& o, const auto& d) { return person_range({4.0, 0.0, 0.0}, o, d); }), at(0.0, 0.0));
    EXPECT_FALSE(run.frame.detection.detections.empty());
    run.frame.odometry.valid = false;
    Detector detector(kSensor, {});
    detector.process(run.frame);
    EXPECT_TRUE(run.frame.detection.detections.empty());
    EXPECT_TRUE(run.frame.detection.pixels.empty());
}

}  // namespace
}  // namespace dlod
