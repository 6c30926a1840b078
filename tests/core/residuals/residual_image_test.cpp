#include "core/residuals/residual_image.hpp"

#include <gtest/gtest.h>

#include <array>

namespace dlod {
namespace {

SensorModel sensor() {
    SensorModel s;
    s.height = 4;
    s.width = 8;
    s.altitude_rad.assign(4, 0.0F);
    s.azimuth_offset_rad.assign(4, 0.0F);
    s.pixel_shift.assign(4, 0);
    return s;
}

TEST(ResidualImage, HoldsResidualsAtTheirPixelsAndForgetsTheFrameBefore) {
    ResidualImage image(sensor());
    OdometryResult odometry;
    odometry.residual_pixel = {3, 17};
    odometry.residual_m = {0.5F, 0.25F};
    image.update(odometry);
    EXPECT_FLOAT_EQ(image.image()[3], 0.5F);
    EXPECT_FLOAT_EQ(image.image()(2, 1), 0.25F);
    odometry.residual_pixel = {4};
    odometry.residual_m = {0.125F};
    image.update(odometry);
    EXPECT_FLOAT_EQ(image.image()[3], 0.0F);
    EXPECT_FLOAT_EQ(image.image()[4], 0.125F);
}

TEST(AverageResidual, IsAlgorithmOne) {
    Image<float> image(4, 8, 0.0F);
    image[1] = 0.5F;
    image[2] = 0.25F;
    image[9] = 4.0F;  // not in the segment
    const std::array<PixelIndex, 4> segment{0, 1, 2, 3};
    const AverageResidual residual = average_residual(segment, image, 10.0F);
    EXPECT_EQ(residual.count, 2);
    EXPECT_DOUBLE_EQ(residual.mean_m, 0.375);
    const std::array<PixelIndex, 2> empty{20, 21};
    EXPECT_EQ(average_residual(empty, image, 10.0F).count, 0);
    EXPECT_DOUBLE_EQ(average_residual(empty, image, 10.0F).mean_m, 0.0);
}

TEST(AverageResidual, IsNoneWhereTheSubmapEnds) {
    constexpr float kCap_m = 1.0F;
    Image<float> image(4, 8, 0.0F);
    const std::array<PixelIndex, 8> segment{0, 1, 2, 3, 4, 5, 6, 7};
    for (PixelIndex p : segment) image[p] = kCap_m;
    EXPECT_EQ(average_residual(segment, image, kCap_m).count, 0);
    image[0] = 0.4F;  // one in eight: the ground beside it, or chance
    EXPECT_EQ(average_residual(segment, image, kCap_m).count, 0);
    image[1] = 0.6F;  // feet and knees of what stands on mapped ground
    EXPECT_EQ(average_residual(segment, image, kCap_m).count, 8);
    EXPECT_NEAR(average_residual(segment, image, kCap_m).mean_m, 0.875, 1e-6);
}

}  // namespace
}  // namespace dlod
