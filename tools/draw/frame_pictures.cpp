#include "tools/draw/frame_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "tools/draw/box_edges.hpp"
#include "tools/draw/colors.hpp"

namespace dlod::tools {
namespace {

constexpr int kPictureWidth = 2048;
constexpr int kPictureHeight = 512;
constexpr float kNear_m = 0.5F;
constexpr float kFar_m = 60.0F;

cv::Size2d pixel_size(int height, int width) {
    return {static_cast<double>(kPictureWidth) / width, static_cast<double>(kPictureHeight) / height};
}

cv::Mat enlarged(const cv::Mat& image) {
    cv::Mat picture;
    cv::resize(image, picture, {kPictureWidth, kPictureHeight}, 0, 0, cv::INTER_NEAREST);
    return picture;
}

/// Near is bright: logarithmic, so that near and far both have contrast.
std::uint8_t brightness(float range_m) {
    const float s = std::log(std::clamp(range_m, kNear_m, kFar_m) / kNear_m) / std::log(kFar_m / kNear_m);
    return static_cast<std::uint8_t>(std::lround(235.0F - 195.0F * s));
}

void caption(cv::Mat& picture, const std::string& text) {
    cv::rectangle(picture, {0, picture.rows - 26}, {16 + 11 * static_cast<int>(text.size()), picture.rows}, kBlack,
                  cv::FILLED);
    cv::putText(picture, text, {8, picture.rows - 8}, cv::FONT_HERSHEY_SIMPLEX, 0.6, kWhite, 1, cv::LINE_AA);
}

void draw_box(cv::Mat& picture, const Track& track, const SensorModel& sensor, const Frame& frame,
              const cv::Size2d& pixel) {
    const cv::Scalar& color = color_of(track.state);
    cv::Point highest(0, picture.rows);
    for (const auto& edge : box_edges(track, sensor, frame)) {
        cv::Point before;
        for (std::size_t i = 0; i < edge.size(); ++i) {
            const cv::Point at(cvRound((edge[i].x + 0.5) * pixel.width), cvRound((edge[i].y + 0.5) * pixel.height));
            const bool across_the_seam = std::abs(at.x - before.x) > picture.cols / 2;
            if (i > 0 && !across_the_seam) cv::line(picture, before, at, color, 1, cv::LINE_AA);
            if (at.y < highest.y) highest = at;
            before = at;
        }
    }
    cv::putText(picture, std::to_string(track.id), highest + cv::Point(-6, -4), cv::FONT_HERSHEY_SIMPLEX, 0.5, color, 1,
                cv::LINE_AA);
}

}  // namespace

cv::Mat draw_range_image(const Frame& frame, const SensorModel& sensor) {
    const auto& range = frame.cloud.range_m;
    const auto& label = frame.detection.label;
    cv::Mat3b image(range.height(), range.width(), cv::Vec3b(0, 0, 0));
    for (int r = 0; r < range.height(); ++r) {
        for (int c = 0; c < range.width(); ++c) {
            if (range(r, c) <= 0.0F) continue;
            const double gray = brightness(range(r, c));
            const auto kind = static_cast<PixelLabel>(label(r, c));
            cv::Scalar color(gray, gray, gray);
            if (kind == PixelLabel::kDynamic) color = 0.25 * color + 0.75 * kDynamicColor;
            if (kind == PixelLabel::kUndecided) color = 0.4 * color + 0.6 * kUndecidedColor;
            for (int channel = 0; channel < 3; ++channel)
                image(r, c)[channel] = cv::saturate_cast<std::uint8_t>(color[channel]);
        }
    }
    cv::Mat picture = enlarged(image);
    const cv::Size2d pixel = pixel_size(range.height(), range.width());
    for (const auto& track : frame.detection.tracks) draw_box(picture, track, sensor, frame, pixel);
    caption(picture, "frame " + std::to_string(frame.header.sequence) +
                         ": range (near is bright), dynamic mask (red), undecided (orange), track boxes: red dynamic, "
                         "orange undecided, blue static");
    return picture;
}

cv::Mat draw_residual_image(const Image<float>& residual_m, double scale_m) {
    cv::Mat1b level(residual_m.height(), residual_m.width(), std::uint8_t{0});
    for (int r = 0; r < residual_m.height(); ++r) {
        for (int c = 0; c < residual_m.width(); ++c) {
            level(r, c) = cv::saturate_cast<std::uint8_t>(255.0 * static_cast<double>(residual_m(r, c)) / scale_m);
        }
    }
    // Only a grid of pixels is registered: each is drawn as large as its share of the grid.
    cv::dilate(level, level, cv::getStructuringElement(cv::MORPH_RECT, {5, 3}));
    cv::Mat colored;
    cv::applyColorMap(level, colored, cv::COLORMAP_INFERNO);
    cv::Mat picture = enlarged(colored);
    caption(picture, "residual image: 0 (dark) to " + std::to_string(static_cast<int>(std::lround(100.0 * scale_m))) +
                         " cm (bright) from the local map; registered pixels, enlarged");
    return picture;
}

}  // namespace dlod::tools
