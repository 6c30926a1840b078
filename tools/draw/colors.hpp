// Colours that all pictures share (OpenCV's order: blue, green, red).
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "core/types/track.hpp"

namespace dlod::tools {

inline const cv::Scalar kWhite{255, 255, 255};
inline const cv::Scalar kBlack{0, 0, 0};
inline const cv::Scalar kText{40, 40, 40};
inline const cv::Scalar kRunPath{200, 90, 20};
inline const cv::Scalar kTruePath{60, 160, 60};
inline const cv::Scalar kDynamicColor{40, 40, 235};
inline const cv::Scalar kUndecidedColor{30, 170, 245};
inline const cv::Scalar kStaticColor{190, 190, 90};

/// Of a track's box: red, orange or blue as it is dynamic, undecided or static.
const cv::Scalar& color_of(DynamicState state);

/// A clear colour that stays with a track's id; neighbouring ids differ.
cv::Scalar color_of_id(std::uint32_t id);

}  // namespace dlod::tools
