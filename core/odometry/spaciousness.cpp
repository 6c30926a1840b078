#include "core/odometry/spaciousness.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr std::size_t kStep = 4;  // every so many points one serves
constexpr double kSmoothing = 0.1;

}  // namespace

double Spaciousness::see(const PointSelection& points) {
    ranges_.clear();
    ranges_.reserve(points.pixel.capacity());
    for (std::size_t i = 0; i < points.size(); i += kStep) {
        ranges_.push_back(points.x[i] * points.x[i] + points.y[i] * points.y[i] + points.z[i] * points.z[i]);
    }
    if (ranges_.empty()) return median_m_;
    const auto middle = ranges_.begin() + static_cast<std::ptrdiff_t>(ranges_.size() / 2);
    std::nth_element(ranges_.begin(), middle, ranges_.end());
    const double now_m = std::sqrt(static_cast<double>(*middle));
    median_m_ = median_m_ > 0.0 ? (1.0 - kSmoothing) * median_m_ + kSmoothing * now_m : now_m;
    return median_m_;
}

}  // namespace dlod
