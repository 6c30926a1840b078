#include "core/removal/box_history.hpp"

#include <numbers>

namespace dlod {

namespace {

constexpr double kSame_m = 0.05;

bool same(const OrientedBox& a, const OrientedBox& b) {
    // A box that turns sweeps over its corners.
    const double swept =
        std::abs(std::remainder(a.yaw_rad - b.yaw_rad, std::numbers::pi)) * 0.5 * a.size_m.head<2>().norm();
    return (a.center_m - b.center_m).norm() < kSame_m && (a.size_m - b.size_m).cwiseAbs().maxCoeff() < kSame_m &&
           swept < kSame_m;
}

}  // namespace

void BoxHistory::add(const OrientedBox& box) {
    if (size_ > 0 && same(boxes_[(first_ + size_ - 1) % kCapacity], box)) return;
    boxes_[(first_ + size_) % kCapacity] = box;
    if (size_ < kCapacity) {
        ++size_;
    } else {
        first_ = (first_ + 1) % kCapacity;
    }
}

void BoxHistory::release(std::vector<OrientedBox>& out) {
    for (std::size_t i = 0; i < size_; ++i) out.push_back(boxes_[(first_ + i) % kCapacity]);
    first_ = size_ = 0;
}

}  // namespace dlod
