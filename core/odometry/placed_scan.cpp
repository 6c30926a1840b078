#include "core/odometry/placed_scan.hpp"

#include <algorithm>
#include <cmath>

#include "core/map/keyframe_cloud.hpp"

namespace dlod {
namespace {

constexpr double kMinSweep_s = 1e-3;
constexpr double kMaxSweep_s = 0.5;

/// Number of points up to the last one that takes part in the registration.
std::size_t taking_part(const PointSelection& points) {
    std::size_t count = points.size();
    while (count > 0 && points.planarity[count - 1] <= 0.0F) --count;
    return count;
}

}  // namespace

void PlacedScan::begin(const PointSelection& points, std::int64_t stamp_ns, double duration_s) {
    points_ = &points;
    stamp_ns_ = stamp_ns;
    duration_s_ = std::clamp(duration_s, kMinSweep_s, kMaxSweep_s);
    left_out_.reserve(points.pixel.capacity());
    left_out_.assign(taking_part(points), 0);
}

void PlacedScan::choose_origin(const Eigen::Vector3d& position_m, double voxel_m) {
    const Eigen::Vector3d p = position_m / voxel_m;
    origin_ = {static_cast<std::int32_t>(std::floor(p.x())), static_cast<std::int32_t>(std::floor(p.y())),
               static_cast<std::int32_t>(std::floor(p.z()))};
    origin_m_ = voxel_m * Eigen::Vector3d(origin_.x, origin_.y, origin_.z);
}

void PlacedScan::share_origin(const PlacedScan& other) {
    origin_ = other.origin_;
    origin_m_ = other.origin_m_;
}

void PlacedScan::move(const MotionFilter& filter) {
    filter.sweep(duration_s_, origin_m_, motion_);
    place(*points_, left_out_.size(), motion_, placed_);
}

void PlacedScan::move_all(const MotionFilter& filter) {
    filter.sweep(duration_s_, origin_m_, motion_);
    place_all();
}

void PlacedScan::place_all() {
    place(*points_, motion_, placed_);
}

void PlacedScan::leave_out(const MovingPoints& moving) {
    moving.mark(placed_, origin_m_, stamp_ns_, left_out_);
}

std::size_t PlacedScan::candidates() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < left_out_.size(); ++i) count += takes_part(i) ? 1 : 0;
    return count;
}

std::size_t PlacedScan::flat_points() const {
    std::size_t flat = 0;
    for (std::size_t i = 0; i < points_->size(); ++i) flat += points_->is_flat(i) ? 1 : 0;
    return flat;
}

KeyframeCloud PlacedScan::cloud() const {
    KeyframeCloud cloud;
    build_keyframe_cloud(placed_, origin_m_, cloud);
    return cloud;
}

}  // namespace dlod
