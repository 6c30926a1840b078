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
        PreparedBox box;
        float reach2 = 0.0F;
    };
    std::array<Local, kMaxBoxes> local;
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
        OrientedBox box = boxes_[b].box;
        box.center_m += age * boxes_[b].velocity_mps - origin_m;
        local[b].box = PreparedBox(box, kMargin_m);
        for (const float half : local[b].box.half_m) local[b].reach2 += half * half;
    }
    for (std::size_t i = 0; i < excluded.size(); ++i) {
        const float x = placed.x[i], y = placed.y[i], z = placed.z[i];
        for (std::size_t b = 0; b < boxes_.size(); ++b) {
            const auto& [box, reach2] = local[b];
            const float dx = x - box.center_m[0], dy = y - box.center_m[1], dz = z - box.center_m[2];
            if (dx * dx + dy * dy + dz * dz <= reach2 && box.contains(x, y, z)) {
                excluded[i] = 1;
                break;
            }
        }
    }
}

}  // namespace dlod
