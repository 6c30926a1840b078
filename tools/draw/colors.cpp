#include "tools/draw/colors.hpp"

#include <opencv2/imgproc.hpp>

namespace dlod::tools {

const cv::Scalar& color_of(DynamicState state) {
    switch (state) {
        case DynamicState::kDynamic:
            return kDynamicColor;
        case DynamicState::kStatic:
            return kStaticColor;
        case DynamicState::kUndefined:
            break;
    }
    return kUndecidedColor;
}

cv::Scalar color_of_id(std::uint32_t id) {
    // Steps of the golden ratio around the circle of hues (OpenCV: 180 of them).
    const auto hue = static_cast<std::uint8_t>((id * 111U) % 180U);
    cv::Mat3b pixel(1, 1, cv::Vec3b(hue, 230, 190));
    cv::cvtColor(pixel, pixel, cv::COLOR_HSV2BGR);
    return cv::Scalar(pixel(0, 0));
}

}  // namespace dlod::tools
