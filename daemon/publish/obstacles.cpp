#include "daemon/publish/obstacles.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace dlod::daemon {
namespace {

/// Offsets in the message: 327 m fit into 16 bits.
constexpr double kUnit_m = 0.01;
/// Voxels a dimension that a key tells apart; the robot's surroundings are far smaller.
constexpr unsigned kKeyBits = 21;

std::int8_t flags_of(std::uint8_t label) {
    if (label == static_cast<std::uint8_t>(PixelLabel::kDynamic)) return obstacles_t::DYNAMIC;
    return label == static_cast<std::uint8_t>(PixelLabel::kUndecided) ? obstacles_t::UNDECIDED : std::int8_t{0};
}

/// Which of two points stands for their voxel.
int weight(std::int8_t flags) {
    return flags == obstacles_t::DYNAMIC ? 2 : flags == obstacles_t::UNDECIDED ? 1 : 0;
}

std::int16_t in_units(float metres) {
    return static_cast<std::int16_t>(std::lround(static_cast<double>(metres) / kUnit_m));
}

}  // namespace

Obstacles::Obstacles(const SensorModel& sensor, const ObstaclesConfig& config, std::size_t most)
    : config_(config), most_(most), slots_(std::bit_ceil(2 * sensor.pixels())) {
    points_.reserve(sensor.pixels());
}

Obstacles::Slot& Obstacles::slot_of(std::uint64_t key) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = static_cast<std::size_t>(key * 0x9E3779B97F4A7C15ULL >> 32U) & mask;
    while (slots_[i].frame == frame_ && slots_[i].key != key) i = (i + 1) & mask;
    return slots_[i];
}

void Obstacles::collect(const Frame& frame, const Eigen::Vector3d& base_in_odom_m) {
    points_.clear();
    if (++frame_ == 0) {
        std::fill(slots_.begin(), slots_.end(), Slot{});
        frame_ = 1;
    }
    const Eigen::Isometry3d& T = frame.odometry.T_world_sensor;
    const Eigen::Matrix3f R = T.linear().cast<float>();
    const Eigen::Vector3d sensor_from_base = T.translation() - base_in_odom_m;
    const Eigen::Vector3f t = sensor_from_base.cast<float>();
    const auto low = static_cast<float>(config_.min_height_m);
    const auto high = static_cast<float>(config_.max_height_m);
    const auto radius2 = static_cast<float>(config_.radius_m * config_.radius_m);
    const double highest = std::max(std::abs(config_.min_height_m), std::abs(config_.max_height_m));
    const auto reach = static_cast<float>(std::hypot(config_.radius_m, highest) + sensor_from_base.norm());
    const Eigen::Vector3d origin_in_voxels = base_in_odom_m / config_.voxel_m;
    const double voxels_a_metre = 1.0 / config_.voxel_m;
    constexpr std::uint64_t kMask = (std::uint64_t{1} << kKeyBits) - 1;
    const auto part = [&](int axis, float offset) {
        const double v = origin_in_voxels[axis] + static_cast<double>(offset) * voxels_a_metre;
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v))) & kMask;
    };
    const auto& label = frame.detection.label;
    for (std::size_t i = 0; i < label.size(); ++i) {
        if (label[i] == static_cast<std::uint8_t>(PixelLabel::kNoReturn) ||
            label[i] == static_cast<std::uint8_t>(PixelLabel::kGround) || frame.cloud.range_m[i] > reach) {
            continue;
        }
        const Eigen::Vector3f p =
            R * Eigen::Vector3f(frame.odometry.x[i], frame.odometry.y[i], frame.odometry.z[i]) + t;
        const float distance2 = p.x() * p.x() + p.y() * p.y();
        if (distance2 > radius2 || p.z() < low || p.z() > high) continue;
        const Point point{p.x(), p.y(), p.z(), distance2, frame.detection.instance[i], flags_of(label[i])};
        const std::uint64_t key = part(0, p.x()) << (2 * kKeyBits) | part(1, p.y()) << kKeyBits | part(2, p.z());
        Slot& slot = slot_of(key);
        if (slot.frame != frame_) {
            slot = {key, frame_, static_cast<std::uint32_t>(points_.size())};
            points_.push_back(point);
        } else if (weight(point.flags) > weight(points_[slot.point].flags)) {
            points_[slot.point] = point;
        }
    }
}

void Obstacles::extract(const Frame& frame, const Eigen::Vector3d& base_in_odom_m, obstacles_t& message) {
    collect(frame, base_in_odom_m);
    std::sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) {
        if (a.distance2_m2 != b.distance2_m2) return a.distance2_m2 < b.distance2_m2;
        if (a.z != b.z) return a.z < b.z;
        return a.x != b.x ? a.x < b.x : a.y < b.y;
    });
    const std::size_t count = std::min(points_.size(), most_);
    message.sequence = static_cast<std::int64_t>(frame.header.sequence);
    Eigen::Vector3d::Map(message.origin) = base_in_odom_m;
    message.unit = kUnit_m;
    message.voxel = config_.voxel_m;
    message.radius =
        count == points_.size() ? config_.radius_m : std::sqrt(static_cast<double>(points_[count].distance2_m2));
    message.left_out = static_cast<std::int32_t>(points_.size() - count);
    message.count = static_cast<std::int32_t>(count);
    for (auto* offsets : {&message.x, &message.y, &message.z}) offsets->resize(count);
    message.track.resize(count);
    message.flags.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Point& p = points_[i];
        message.x[i] = in_units(p.x);
        message.y[i] = in_units(p.y);
        message.z[i] = in_units(p.z);
        message.track[i] = static_cast<std::int32_t>(p.track);
        message.flags[i] = p.flags;
    }
}

}  // namespace dlod::daemon
