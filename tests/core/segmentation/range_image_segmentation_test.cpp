#include "core/segmentation/range_image_segmentation.hpp"

#include <gtest/gtest.h>

#include <map>
#include <queue>
#include <random>

#include "tests/support/rendered_scene.hpp"

namespace dlod {
namespace {

const SensorModel kSensor = test::even_sensor(64, 256, 0.35, -0.35);

/// The method as published: a breadth-first search with the angle itself.
std::vector<int> breadth_first(const SensorModel& sensor, const Frame& frame, const SegmentationConfig& config) {
    const auto usable = [&](int r, int c) {
        const double range = static_cast<double>(frame.cloud.range_m(r, c));
        return frame.prepared.ground(r, c) == 0 && range >= config.min_range_m && range <= config.max_range_m;
    };
    const auto connected = [&](int r1, int c1, int r2, int c2) {
        const double a = static_cast<double>(frame.cloud.range_m(r1, c1));
        const double b = static_cast<double>(frame.cloud.range_m(r2, c2));
        const double alpha = r1 == r2
                                 ? 2.0 * std::numbers::pi / sensor.width
                                 : std::abs(static_cast<double>(sensor.altitude_rad[static_cast<std::size_t>(r1)]) -
                                            static_cast<double>(sensor.altitude_rad[static_cast<std::size_t>(r2)]));
        const double far = std::max(a, b);
        const double near = std::min(a, b);
        const double beta = std::atan2(near * std::sin(alpha), far - near * std::cos(alpha));
        return beta > config.angle_threshold_rad && far - near <= config.max_depth_step_m;
    };
    std::vector<int> label(sensor.pixels(), 0);
    int next = 0;
    for (int r0 = 0; r0 < sensor.height; ++r0) {
        for (int c0 = 0; c0 < sensor.width; ++c0) {
            if (!usable(r0, c0) || label[static_cast<std::size_t>(r0 * sensor.width + c0)] != 0) continue;
            ++next;
            std::queue<std::pair<int, int>> queue;
            label[static_cast<std::size_t>(r0 * sensor.width + c0)] = next;
            queue.emplace(r0, c0);
            while (!queue.empty()) {
                const auto [r, c] = queue.front();
                queue.pop();
                for (const auto& [dr, dc] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
                    const int nr = r + dr;
                    const int nc = (c + dc + sensor.width) % sensor.width;
                    if (nr < 0 || nr >= sensor.height || !usable(nr, nc)) continue;
                    int& other = label[static_cast<std::size_t>(nr * sensor.width + nc)];
                    if (other != 0 || !connected(r, c, nr, nc)) continue;
                    other = next;
                    queue.emplace(nr, nc);
                }
            }
        }
    }
    return label;
}

void fill_points(Frame& frame) {
    for (std::size_t i = 0; i < frame.cloud.range_m.size(); ++i) {
        const int r = static_cast<int>(i) / kSensor.width;
        const int c = static_cast<int>(i) % kSensor.width;
        const Eigen::Vector3d p = static_cast<double>(frame.cloud.range_m[i]) * test::beam(kSensor, r, c);
        frame.cloud.x[i] = static_cast<float>(p.x());
        frame.cloud.y[i] = static_cast<float>(p.y());
        frame.cloud.z[i] = static_cast<float>(p.z());
    }
}

TEST(RangeImageSegmentation, EqualsBreadthFirstSearchOnRandomImages) {
    std::mt19937 random(7);
    for (int trial = 0; trial < 20; ++trial) {
        Frame frame(kSensor);
        // Blocks of equal range with noise, holes and ground.
        for (int r = 0; r < kSensor.height; ++r) {
            for (int c = 0; c < kSensor.width; ++c) {
                const unsigned block = static_cast<unsigned>(r / 5) * 131U + static_cast<unsigned>(c / 9) * 37U +
                                       static_cast<unsigned>(trial);
                const float base = 2.0F + static_cast<float>(block * 2654435761U % 7U);
                const unsigned dice = random() % 20;
                frame.cloud.range_m(r, c) = dice == 0 ? 0.0F : base + 0.01F * static_cast<float>(random() % 10);
                frame.prepared.ground(r, c) = dice == 1 ? 1 : 0;
            }
        }
        fill_points(frame);
        SegmentationConfig config;
        config.min_points = 1;
        RangeImageSegmentation segmentation(kSensor, config);
        segmentation.process(frame);
        const std::vector<int> expected = breadth_first(kSensor, frame, config);
        std::map<std::uint32_t, int> partner;
        for (std::size_t i = 0; i < expected.size(); ++i) {
            const std::uint32_t found = frame.prepared.segment[i];
            ASSERT_EQ(found == 0, expected[i] == 0) << i;
            if (found == 0) continue;
            const auto [entry, fresh] = partner.emplace(found, expected[i]);
            ASSERT_EQ(entry->second, expected[i]) << i;
        }
        // As many segments on both sides: the partition is the same.
        ASSERT_EQ(static_cast<int>(partner.size()), *std::max_element(expected.begin(), expected.end()));
    }
}

TEST(RangeImageSegmentation, SegmentsDescribeTheirPixels) {
    Frame frame(kSensor);
    for (int r = 20; r < 40; ++r) {
        for (int c = 250; c < 262; ++c) frame.cloud.range_m(r, c % kSensor.width) = 5.0F;  // across the image's seam
    }
    for (int r = 10; r < 12; ++r) frame.cloud.range_m(r, 100) = 8.0F;  // too small
    fill_points(frame);
    RangeImageSegmentation segmentation(kSensor, {});
    segmentation.process(frame);
    ASSERT_EQ(frame.prepared.segments.size(), 1U);
    const Segment& segment = frame.prepared.segments[0];
    EXPECT_EQ(segment.count, 240U);
    EXPECT_EQ(segment.rows, 20);
    EXPECT_FLOAT_EQ(segment.max_range_m, 5.0F);
    EXPECT_NEAR(segment.length_m, 5.0F * 11.0F * 2.0F * std::numbers::pi_v<float> / 256.0F, 0.1F);
    EXPECT_TRUE(segment.feasible);
    ASSERT_EQ(frame.prepared.pixels.size(), 240U);
    for (const PixelIndex pixel : frame.prepared.pixels) {
        EXPECT_EQ(frame.prepared.segment[pixel], 1U);
        EXPECT_LE(segment.min_m.x(), frame.cloud.x[pixel]);
        EXPECT_GE(segment.max_m.z(), frame.cloud.z[pixel]);
    }
    // Nothing of the frame before survives.
    frame.cloud.range_m.fill(0.0F);
    segmentation.process(frame);
    EXPECT_TRUE(frame.prepared.segments.empty());
    EXPECT_TRUE(frame.prepared.pixels.empty());
    EXPECT_EQ(frame.prepared.segment(30, 255), 0U);
}

TEST(Feasibility, EachRuleRejects) {
    Segment person;
    person.count = 100;
    person.rows = 20;
    person.min_m = {4.0F, 0.0F, -1.1F};
    person.max_m = {4.4F, 0.5F, 0.6F};
    person.length_m = 0.6F;
    person.max_range_m = 5.0F;
    const FeasibilityConfig config;
    EXPECT_TRUE(is_feasible(person, config));
    const auto rejected = [&](auto change) {
        Segment changed = person;
        change(changed);
        return !is_feasible(changed, config);
    };
    EXPECT_TRUE(rejected([](Segment& s) { s.count = 3; }));
    EXPECT_TRUE(rejected([](Segment& s) { s.rows = 1; }));
    EXPECT_TRUE(rejected([](Segment& s) { s.max_m.z() = s.min_m.z() + 0.1F; }));
    EXPECT_TRUE(rejected([](Segment& s) { s.max_m.z() = s.min_m.z() + 6.0F; }));
    EXPECT_TRUE(rejected([](Segment& s) { s.length_m = 40.0F; }));
    EXPECT_TRUE(rejected([](Segment& s) { s.min_m.z() = 2.0F, s.max_m.z() = 3.0F; }));
    EXPECT_TRUE(rejected([](Segment& s) { s.max_range_m = 80.0F; }));
    EXPECT_TRUE(rejected([](Segment& s) { s.max_m.x() = s.min_m.x() + 0.01F, s.max_m.y() = 0.02F; }));
}

}  // namespace
}  // namespace dlod
