#include "core/residuals/residual_image.hpp"

namespace dlod {

namespace {

constexpr int kMostUnknown = 4;  // points to one that has something of the submap near it: the head of what stands on
                                 // mapped ground has not

}  // namespace

void ResidualImage::update(const OdometryResult& odometry) {
    for (const PixelIndex pixel : filled_) image_[pixel] = 0.0F;
    filled_.assign(odometry.residual_pixel.begin(), odometry.residual_pixel.end());
    for (std::size_t i = 0; i < odometry.residual_pixel.size(); ++i)
        image_[odometry.residual_pixel[i]] = odometry.residual_m[i];
}

AverageResidual average_residual(std::span<const PixelIndex> segment, const Image<float>& residual_image, float cap_m) {
    double sum = 0.0;
    int n = 0;
    int known = 0;
    for (const PixelIndex pixel : segment) {
        const float residual = residual_image[pixel];
        if (residual == 0.0F) continue;
        sum += static_cast<double>(residual);
        ++n;
        known += residual < cap_m ? 1 : 0;
    }
    if (known == 0 || known * kMostUnknown < n) return {};
    return {sum / n, n};
}

}  // namespace dlod
