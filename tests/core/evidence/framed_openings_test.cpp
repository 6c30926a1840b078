#include "core/evidence/framed_openings.hpp"

#include <gtest/gtest.h>

#include "core/evidence/detection.hpp"
#include "core/segmentation/ground_removal.hpp"
#include "core/segmentation/range_image_segmentation.hpp"
#include "tests/support/rendered_scene.hpp"

namespace dlod {
namespace {

const SensorModel kSensor = test::even_sensor(96, 512, 0.5, -0.7);

struct Car {
    double y_m = 0.0;             ///< of its middle
    bool window_returns = false;  ///< else what is behind it is seen
    double window_top_m = 1.3;    ///< the car is 1.5 m tall
};

/// A room with a car whose side, with one window, is 4.5 m before the sensor.
double car_in_a_room(const Car& car, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double range = test::plane_range(Eigen::Vector3d::UnitZ(), 0.0, o, d);
    for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 1.0, 0.0)}) {
        for (const double side_m : {-12.0, 12.0}) range = test::nearest(range, test::plane_range(axis, side_m, o, d));
    }
    const Eigen::Vector3d middle(5.4, car.y_m, 0.9);
    const Eigen::Vector3d half(0.9, 2.2, 0.6);
    const double body = test::box_range(middle - half, middle + half, o, d);
    const Eigen::Vector3d hit = o + body * d;
    const bool window =
        std::abs(hit.y() - car.y_m) < 0.7 && hit.z() > 0.95 && hit.z() < car.window_top_m && hit.x() < 4.6;
    return window && !car.window_returns ? range : test::nearest(range, body);
}

/// What is found free and occupied of the car in the last of some frames.
EvidenceImage::Counts counts_of(const FramedOpeningsConfig& openings, const std::function<Car(int)>& car_at) {
    constexpr int kFrames = 12;
    DetectionConfig config;
    config.openings = openings;
    GroundRemoval ground(kSensor, {});
    RangeImageSegmentation segmentation(kSensor, {});
    Detector detector(kSensor, config);
    Frame frame(kSensor);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation().z() = 1.2;
    for (int k = 0; k < kFrames; ++k) {
        const Car car = car_at(k);
        test::render(
            kSensor, [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d) { return car_in_a_room(car, o, d); }, pose,
            frame);
        frame.header.stamp_ns = 1'000'000'000 + 100'000'000 * static_cast<std::int64_t>(k);
        ground.process(frame);
        segmentation.process(frame);
        detector.process(frame);
        ++frame.header.sequence;
    }
    EvidenceImage::Counts counts;
    for (const Detection& detection : frame.detection.detections) {
        counts.free += detection.free_points;
        counts.occupied += detection.occupied_points;
    }
    return counts;
}

Car window_begins_to_return(int frame) {
    return {.window_returns = frame >= 11};
}

TEST(FramedOpenings, WindowOfAParkedCarIsNoMotion) {
    const auto counts = counts_of({}, window_begins_to_return);
    EXPECT_EQ(counts.free, 0);
    EXPECT_GT(counts.occupied, 40);
}

TEST(FramedOpenings, WithoutReachNoneIsLookedFor) {
    EXPECT_GT(counts_of({.reach_m = 0.0}, window_begins_to_return).free, 20);
}

// The roof is no higher than the sensor: nothing is seen above the window.
TEST(FramedOpenings, AWindowWithoutAnUpperSideIsAboveTheBodyOfTheCar) {
    const auto counts =
        counts_of({}, [](int frame) { return Car{.window_returns = frame >= 11, .window_top_m = 2.0}; });
    EXPECT_LT(counts.free, 15);  // of 148: not every pixel of the body is tested
    EXPECT_GT(counts.occupied, 40);
}

TEST(FramedOpenings, CarThatDrivesIsStillSeen) {
    const auto counts = counts_of({}, [](int frame) { return Car{.y_m = -5.0 + 0.7 * frame, .window_returns = true}; });
    EXPECT_GT(counts.free, 40);
}

}  // namespace
}  // namespace dlod
