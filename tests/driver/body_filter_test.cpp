#include "driver/body_filter.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/types/lie.hpp"

namespace dlod::driver {
namespace {

SensorModel sensor_of(int height, int width) {
    SensorModel sensor;
    sensor.height = height;
    sensor.width = width;
    return sensor;
}

/// Points anywhere in a cube of 3 m around the sensor; every tenth pixel has no return, rows from 8 on see only far
/// ones.
void fill(Frame& frame) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> near(-1.5F, 1.5F);
    const auto width = static_cast<std::size_t>(frame.cloud.x.width());
    for (std::size_t i = 0; i < frame.cloud.x.size(); ++i) {
        const float scale = i / width < 8 ? 1.0F : 20.0F;
        Eigen::Vector3f p(near(random), near(random), near(random));
        if (scale > 1.0F) p = p.normalized() * 20.0F;
        if (i % 10 == 0) p.setZero();
        frame.cloud.x[i] = p.x();
        frame.cloud.y[i] = p.y();
        frame.cloud.z[i] = p.z();
        frame.cloud.range_m[i] = p.norm();
        frame.raw.range_mm[i] = static_cast<std::uint32_t>(1000.0F * p.norm());
    }
}

TEST(BodyFilter, ReturnsInsideOfTheBoxesAreNoneAndOthersStay) {
    const SensorModel sensor = sensor_of(16, 513);
    Frame frame(sensor);
    fill(frame);
    const Frame before = frame;
    const Eigen::Isometry3d T_base_sensor =
        make_pose(so3_exp(Eigen::Vector3d(0.1, -0.2, 2.0)), Eigen::Vector3d(0.3, -0.1, 0.9));
    const std::vector<BodyBox> boxes = {{{-0.5, -0.4, 0.0}, {0.6, 0.4, 0.8}}, {{0.2, -0.2, 0.8}, {0.4, 0.2, 1.6}}};
    BodyFilter(T_base_sensor, boxes).process(frame);
    int removed = 0;
    for (std::size_t i = 0; i < sensor.pixels(); ++i) {
        const Eigen::Vector3d p =
            T_base_sensor * Eigen::Vector3f(before.cloud.x[i], before.cloud.y[i], before.cloud.z[i]).cast<double>();
        bool inside = false;
        bool at_the_rim = false;
        for (const auto& box : boxes) {
            inside = inside || ((p.array() >= box.low_m.array()) && (p.array() <= box.high_m.array())).all();
            at_the_rim = at_the_rim || (p - box.low_m).cwiseAbs().minCoeff() < 1e-5 ||
                         (p - box.high_m).cwiseAbs().minCoeff() < 1e-5;
        }
        if (at_the_rim) continue;
        ASSERT_EQ(frame.cloud.x[i], inside ? 0.0F : before.cloud.x[i]) << i;
        ASSERT_EQ(frame.cloud.y[i], inside ? 0.0F : before.cloud.y[i]) << i;
        ASSERT_EQ(frame.cloud.z[i], inside ? 0.0F : before.cloud.z[i]) << i;
        ASSERT_EQ(frame.cloud.range_m[i], inside ? 0.0F : before.cloud.range_m[i]) << i;
        ASSERT_EQ(frame.raw.range_mm[i], inside ? 0U : before.raw.range_mm[i]) << i;
        removed += inside && before.cloud.range_m[i] > 0.0F ? 1 : 0;
    }
    EXPECT_GT(removed, 50) << "else this would show little";
}

TEST(BodyFilter, WithoutBoxesNothingChanges) {
    const SensorModel sensor = sensor_of(16, 512);
    Frame frame(sensor);
    fill(frame);
    const Frame before = frame;
    BodyFilter().process(frame);
    for (std::size_t i = 0; i < sensor.pixels(); ++i) ASSERT_EQ(frame.cloud.x[i], before.cloud.x[i]);
}

}  // namespace
}  // namespace dlod::driver
