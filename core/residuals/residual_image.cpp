#include "core/residuals/residual_image.hpp"

namespace dlod {

void ResidualImage::update(const OdometryResult& odometry) {
    image_.fill(0.0F);
    for (std::size_t i = 0; i < odometry.residual_pixel.size(); ++i) image_[odometry.residual_pixel[i]] = odometry.residual_m[i];
}

AverageResidual average_residual(std::span<const PixelIndex> segment, const Image<float>& residual_image) {
    double sum = 0.0;
    int n = 0;
    for (const PixelIndex pixel : segment) {
        const float residual = residual_image[pixel];
        if (residual == 0.0F) continue;
        sum += static_cast<double>(residual);
        ++n;
    }
    return {n > 0 ? sum / n : 0.0, n};
}

}  // namespace dlod
