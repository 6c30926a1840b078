#include "core/removal/dynamic_points_removal.hpp"

#include <gtest/gtest.h>

#include "tests/support/synthetic_frame.hpp"

namespace dlod {
namespace {

std::uint8_t value(PixelLabel label) {
    return static_cast<std::uint8_t>(label);
}

/// Three objects, dynamic, static and undecided (tracks 7, 8, 9), one that has no track, ground and background.
class DynamicPointsRemovalTest : public ::testing::Test {
  protected:
    DynamicPointsRemovalTest() : sensor(test::small_sensor()), scene(sensor), removal(sensor, config) {
        scene.next();
        for (int i = 0; i < 4; ++i) {
            test::Cylinder c;
            c.foot_m = {4.0 + i, 2.0, -1.0};
            pixels.push_back(scene.place(c));
            scene.detect(pixels.back(), i == 0);
        }
        background = static_cast<PixelIndex>(pixels.back().back() + 1);
        ground = background + 1;
        for (PixelIndex p : {background, ground}) {
            scene.frame.raw.range_mm[p] = 5000;
            scene.frame.odometry.x[p] = 5.0F;
        }
        scene.frame.prepared.ground[ground] = 1;
        for (int i = 0; i < 3; ++i) {
            Track t;
            t.id = static_cast<std::uint32_t>(7 + i);
            t.state = i == 0 ? DynamicState::kDynamic : i == 1 ? DynamicState::kStatic : DynamicState::kUndefined;
            t.velocity_mps = {1.0, 0.0, 0.0};
            scene.frame.detection.tracks.push_back(t);
            scene.frame.detection.detections[static_cast<std::size_t>(i)].track = i;
        }
        for (PixelIndex p = 0; p < ground + 1; ++p) {
            auto& points = scene.frame.prepared.points;
            points.pixel.push_back(p);
            points.measurement.push_back(static_cast<std::uint16_t>(p % 256));
            points.x.push_back(scene.frame.odometry.x[p]);
            points.y.push_back(scene.frame.odometry.y[p]);
            points.z.push_back(scene.frame.odometry.z[p]);
            for (auto* v : {&points.nx, &points.ny, &points.planarity, &points.time_s}) v->push_back(0.0F);
            points.nz.push_back(1.0F);
        }
        const auto& points = scene.frame.prepared.points;
        scene.frame.odometry.keyframe_points = {points.x, points.y, points.z, points.nx, points.ny, points.nz};
    }

    RemovalConfig config;
    SensorModel sensor;
    test::SyntheticFrame scene;
    DynamicPointsRemoval removal;
    OdometryFeedback feedback;
    std::vector<std::vector<PixelIndex>> pixels;
    PixelIndex background = 0, ground = 0;
};

TEST_F(DynamicPointsRemovalTest, EveryPixelHasItsLabelAndInstance) {
    removal.process(scene.frame, feedback);
    const auto& d = scene.frame.detection;
    const std::uint8_t expected[] = {value(PixelLabel::kDynamic), value(PixelLabel::kStatic),
                                     value(PixelLabel::kUndecided), value(PixelLabel::kUndecided)};
    const std::uint32_t id[] = {7, 8, 9, 0};
    for (std::size_t i = 0; i < 4; ++i) {
        for (PixelIndex p : pixels[i]) {
            EXPECT_EQ(d.label[p], expected[i]);
            EXPECT_EQ(d.instance[p], id[i]);
        }
    }
    EXPECT_EQ(d.label[background], value(PixelLabel::kStatic));
    EXPECT_EQ(d.label[ground], value(PixelLabel::kGround));
    EXPECT_EQ(d.label[ground + 1], value(PixelLabel::kNoReturn));
    EXPECT_EQ(d.dynamic_points, static_cast<int>(pixels[0].size()));
}

// The reference masked the pixels of tracks that had not been seen for up to nine scans.
TEST_F(DynamicPointsRemovalTest, APredictedTrackMarksNoPixel) {
    removal.process(scene.frame, feedback);
    DynamicPointsRemoval::take_back(scene.frame);
    scene.frame.detection.detections.clear();
    removal.process(scene.frame, feedback);
    for (std::size_t p = 0; p < scene.frame.detection.label.size(); ++p) {
        EXPECT_NE(scene.frame.detection.label[p], value(PixelLabel::kDynamic));
        EXPECT_EQ(scene.frame.detection.instance[p], 0U);
    }
    EXPECT_EQ(scene.frame.detection.dynamic_points, 0);
    EXPECT_EQ(feedback.moving.size(), 1U);  // but the odometry still hears of it
}

TEST_F(DynamicPointsRemovalTest, AnInvalidPoseKnowsNoGroundAndNoMotion) {
    scene.frame.odometry.valid = false;
    removal.process(scene.frame, feedback);
    for (std::size_t p = 0; p < scene.frame.detection.label.size(); ++p) {
        const std::uint8_t label = scene.frame.detection.label[p];
        EXPECT_TRUE(label == value(PixelLabel::kNoReturn) || label == value(PixelLabel::kStatic) ||
                    label == value(PixelLabel::kUndecided));
    }
    EXPECT_EQ(scene.frame.detection.label[pixels[0][0]], value(PixelLabel::kUndecided));
    EXPECT_TRUE(feedback.moving.empty());
    EXPECT_FALSE(feedback.has_keyframe);
}

TEST_F(DynamicPointsRemovalTest, KeyframesHoldWhatDoesNotMove) {
    scene.frame.odometry.keyframe = true;
    scene.frame.odometry.T_world_sensor.translation() = Eigen::Vector3d(1, 2, 3);
    removal.process(scene.frame, feedback);
    ASSERT_TRUE(feedback.has_keyframe);
    // All but the dynamic object, and one point each of background and ground.
    EXPECT_EQ(feedback.keyframe.x.size(), pixels[1].size() + pixels[2].size() + pixels[3].size() + 2);
    EXPECT_EQ(feedback.keyframe.nz.size(), feedback.keyframe.x.size());
    EXPECT_EQ(feedback.keyframe.nz[0], 1.0F);
    EXPECT_EQ(feedback.keyframe.T_world_sensor.translation(), Eigen::Vector3d(1, 2, 3));
    const PixelIndex first = pixels[1][0];
    EXPECT_EQ(feedback.keyframe.x[0], scene.frame.odometry.x[first]);
}

TEST_F(DynamicPointsRemovalTest, ThePastIsClearedWithAMargin) {
    OrientedBox box;
    box.size_m = {1.0, 1.0, 1.0};
    scene.frame.detection.cleared = {box};
    removal.process(scene.frame, feedback);
    ASSERT_EQ(feedback.cleared.size(), 1U);
    EXPECT_NEAR(feedback.cleared[0].size_m.x(), 1.0 + 2.0 * config.margin_m, 1e-12);
    EXPECT_EQ(scene.frame.detection.cleared[0].size_m, feedback.cleared[0].size_m);
}

}  // namespace
}  // namespace dlod
