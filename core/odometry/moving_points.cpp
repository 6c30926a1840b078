#include "core/odometry/moving_points.hpp"

#include <cmath>

namespace dlod {
namespace {

constexpr double kMargin_m = 0.25;  // legs and arms outside the box, error of the prediction
constexpr double kMaxAge_s = 1.0;   // older predictions say nothing
constexpr std::size_t kMaxBoxes = 256;

}  // namespace

void MovingPoints::set(std::span<const MovingBox> boxes, std::int64_t stamp_ns) {
    boxes_.reserve(kMaxBoxes);
    boxes_.assign(boxes.begin(), boxes.begin() + static_cast<std::ptrdiff_t>(std::min(boxes.size(), kMaxBoxes)));
    stamp_ns_ = stamp_ns;
}

void MovingPoints::mark(const PlacedPoints& placed, const Eigen::Vector3d& origin_m, std::int64_t stamp_ns,
                        std::span<std::uint8_t> excluded) const {
    const double age = static_cast<double>(stamp_ns - stamp_ns_) * 1e-9;
    if (boxes_.empty() || age < 0.0 || age > kMaxAge_s) return;
    struct Local {
        float center[3], cosine, sine, half[3], reach2;
    };
    std::array<Local, kMaxBoxes> local;
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
        const OrientedBox& box = boxes_[b].box;
        const Eigen::Vector3d center = box.center_m + age * boxes_[b].velocity_mps - origin_m;
        float reach2 = 0.0F;
        for (int i = 0; i < 3; ++i) {
            local[b].center[i] = static_cast<float>(center[i]);
            local[b].half[i] = static_cast<float>(0.5 * box.size_m[i] + kMargin_m);
            reach2 += local[b].half[i] * local[b].half[i];
        }
        local[b].reach2 = reach2;
        local[b].cosine = static_cast<float>(std::cos(box.yaw_rad));
        local[b].sine = static_cast<float>(std::sin(box.yaw_rad));
    }
    for (std::size_t i = 0; i < excluded.size(); ++i) {
        for (std::size_t b = 0; b < boxes_.size(); ++b) {
            const Local& box = local[b];
            const float dx = placed.x[i] - box.center[0];
            const float dy = placed.y[i] - box.center[1];
            const float dz = placed.z[i] - box.center[2];
            if (dx * dx + dy * dy + dz * dz > box.reach2) continue;
            if (std::abs(box.cosine * dx + box.sine * dy) <= box.half[0] &&
                std::abs(-box.sine * dx + box.cosine * dy) <= box.half[1] && std::abs(dz) <= box.half[2]) {
                excluded[i] = 1;
                break;
            }
        }
    }
}

}  // namespace dlod
