#include "driver/body_filter.hpp"

#include <algorithm>

#include "core/types/multiversion.hpp"

namespace dlod::driver {
namespace {

/// Is any return as near as that?
DLOD_MULTIVERSION
bool any_within(std::size_t count, const float* __restrict range_m, float reach_m) {
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < count; ++i) {
        found |= static_cast<std::uint32_t>(range_m[i] > 0.0F) & static_cast<std::uint32_t>(range_m[i] <= reach_m);
    }
    return found != 0;
}

DLOD_MULTIVERSION
void remove_inside(std::size_t count, const float* __restrict T, const float* __restrict low,
                   const float* __restrict high, std::uint32_t* __restrict raw_mm, float* __restrict range_m,
                   float* __restrict x, float* __restrict y, float* __restrict z) {
    const float r00 = T[0], r01 = T[1], r02 = T[2], tx = T[3];
    const float r10 = T[4], r11 = T[5], r12 = T[6], ty = T[7];
    const float r20 = T[8], r21 = T[9], r22 = T[10], tz = T[11];
    const float x0 = low[0], y0 = low[1], z0 = low[2];
    const float x1 = high[0], y1 = high[1], z1 = high[2];
    for (std::size_t i = 0; i < count; ++i) {
        const float bx = r00 * x[i] + r01 * y[i] + r02 * z[i] + tx;
        const float by = r10 * x[i] + r11 * y[i] + r12 * z[i] + ty;
        const float bz = r20 * x[i] + r21 * y[i] + r22 * z[i] + tz;
        const bool inside = (bx >= x0) & (bx <= x1) & (by >= y0) & (by <= y1) & (bz >= z0) & (bz <= z1);
        raw_mm[i] = inside ? 0U : raw_mm[i];
        range_m[i] = inside ? 0.0F : range_m[i];
        x[i] = inside ? 0.0F : x[i];
        y[i] = inside ? 0.0F : y[i];
        z[i] = inside ? 0.0F : z[i];
    }
}

}  // namespace

BodyFilter::BodyFilter(const Eigen::Isometry3d& T_base_sensor, const std::vector<BodyBox>& boxes) {
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 4; ++j) T_base_sensor_[4 * i + j] = static_cast<float>(T_base_sensor.matrix()(i, j));
    }
    for (const BodyBox& box : boxes) {
        Bounds bounds;
        Eigen::Vector3f::Map(bounds.low) = box.low_m.cast<float>();
        Eigen::Vector3f::Map(bounds.high) = box.high_m.cast<float>();
        boxes_.push_back(bounds);
        const Eigen::Vector3d farthest = (box.low_m - T_base_sensor.translation())
                                             .cwiseAbs()
                                             .cwiseMax((box.high_m - T_base_sensor.translation()).cwiseAbs());
        reach_m_ = std::max(reach_m_, static_cast<float>(farthest.norm()));
    }
}

void BodyFilter::process(Frame& frame) const {
    if (boxes_.empty()) return;
    StructuredCloud& cloud = frame.cloud;
    const auto width = static_cast<std::size_t>(cloud.range_m.width());
    for (int r = 0; r < cloud.range_m.height(); ++r) {
        float* const range = cloud.range_m.row(r);
        if (!any_within(width, range, reach_m_)) continue;
        for (const Bounds& box : boxes_) {
            remove_inside(width, T_base_sensor_, box.low, box.high, frame.raw.range_mm.row(r), range, cloud.x.row(r),
                          cloud.y.row(r), cloud.z.row(r));
        }
    }
}

}  // namespace dlod::driver
