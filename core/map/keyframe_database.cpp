#include "core/map/keyframe_database.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/map/keyframe_hulls.hpp"

namespace dlod {
namespace {

constexpr std::size_t kAnchors = 5;
// The first scans all become keyframes, so that the map does not rest on the noise of a single one.
constexpr std::size_t kFirstKeyframes = 5;
constexpr std::size_t kMaxAnnounced = 16;
// Beyond this, 488 km, fixed point has no room.
constexpr double kMaxFixed = 2e9;

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
    return 2.0 * std::acos(std::min(1.0, std::abs(a.dot(b))));
}

std::int16_t to_normal_units(double v) {
    return static_cast<std::int16_t>(std::lround(std::clamp(v, -1.0, 1.0) * kNormalUnits));
}

}  // namespace

KeyframeDatabase::KeyframeDatabase(const KeyframeConfig& config, const VoxelMapConfig& voxels)
    : config_(config), submap_(voxels) {
    const auto most = static_cast<std::size_t>(config.max_keyframes) + 1;
    keyframes_.reserve(most);
    announced_.reserve(kMaxAnnounced);
    chosen_.reserve(most);
    order_.reserve(most);
}

double KeyframeDatabase::spacing_m(double spaciousness_m) const {
    return std::clamp(config_.distance_share * spaciousness_m, config_.min_distance_m, config_.max_distance_m);
}

bool KeyframeDatabase::is_due(const Eigen::Isometry3d& T, double spaciousness_m) const {
    if (keyframes_.size() + announced_.size() < kFirstKeyframes) return true;
    const double distance = spacing_m(spaciousness_m);
    const double angle = config_.angle_deg * std::numbers::pi / 180.0;
    const Eigen::Quaterniond rotation(T.rotation());
    const auto covers = [&](const Eigen::Vector3d& position, const Eigen::Quaterniond& other) {
        return (position - T.translation()).norm() < distance && angle_between(rotation, other) < angle;
    };
    for (const Keyframe& k : keyframes_) {
        if (covers(k.position_m, k.rotation)) return false;
    }
    for (const Announced& a : announced_) {
        if (covers(a.T_world_sensor.translation(), Eigen::Quaterniond(a.T_world_sensor.rotation()))) return false;
    }
    return true;
}

void KeyframeDatabase::announce(const Eigen::Isometry3d& T_world_sensor, const Matrix6d& covariance) {
    // One that never came (its frame was dropped) makes room.
    if (announced_.size() == announced_.capacity()) announced_.erase(announced_.begin());
    announced_.push_back({T_world_sensor, covariance});
}

Matrix6d KeyframeDatabase::anchor_covariance(const Eigen::Vector3d& position_m) const {
    Matrix6d sum = Matrix6d::Zero();
    const std::size_t count = std::min(order_.size(), kAnchors);
    for (std::size_t i = 0; i < count; ++i) {
        const Keyframe& keyframe = keyframes_[order_[i].second];
        Matrix6d J = Matrix6d::Identity();
        J.block<3, 3>(0, 3) = -skew(position_m - keyframe.position_m);
        sum += J * keyframe.covariance * J.transpose();
    }
    return count > 0 ? Matrix6d(sum / static_cast<double>(count)) : sum;
}

double KeyframeDatabase::newness(const Eigen::Vector3d& position_m, double spaciousness_m) const {
    if (order_.empty()) return 0.0;
    const double way_m = (keyframes_[order_.front().second].position_m - position_m).norm();
    return std::min(1.0, way_m / spacing_m(spaciousness_m));
}

void KeyframeDatabase::convert(const KeyframeCloud& cloud, std::vector<FixedPoint>& points) {
    const Eigen::Matrix3d R = cloud.T_world_sensor.rotation();
    points.clear();
    points.reserve(cloud.x.size());
    for (std::size_t i = 0; i < cloud.x.size(); ++i) {
        const Eigen::Vector3d p =
            cloud.T_world_sensor * Eigen::Vector3d(cloud.x[i], cloud.y[i], cloud.z[i]) / kMapUnit_m;
        const Eigen::Vector3d n = R * Eigen::Vector3d(cloud.nx[i], cloud.ny[i], cloud.nz[i]);
        if (!(p.cwiseAbs().maxCoeff() < kMaxFixed)) continue;
        points.push_back({static_cast<std::int32_t>(std::lround(p.x())), static_cast<std::int32_t>(std::lround(p.y())),
                          static_cast<std::int32_t>(std::lround(p.z())), to_normal_units(n.x()), to_normal_units(n.y()),
                          to_normal_units(n.z())});
    }
}

void KeyframeDatabase::add(const KeyframeCloud& cloud) {
    submap_.remove(provisional_);
    provisional_.clear();
    Matrix6d covariance = Matrix6d::Zero();
    std::erase_if(announced_, [&](const Announced& a) {
        if (a.T_world_sensor.matrix() != cloud.T_world_sensor.matrix()) return false;
        covariance = a.covariance;
        return true;
    });
    if (keyframes_.size() >= static_cast<std::size_t>(config_.max_keyframes)) {
        forget_farthest(cloud.T_world_sensor.translation());
    }
    hulls_are_old_ = true;
    Keyframe& keyframe = keyframes_.emplace_back();
    keyframe.position_m = cloud.T_world_sensor.translation();
    keyframe.rotation = Eigen::Quaterniond(cloud.T_world_sensor.rotation());
    keyframe.covariance = covariance;
    convert(cloud, keyframe.points);
    sort_by_place(keyframe.points);
    find_bounds(keyframe);
}

/// Brings neighbours together, so that they share chunks and voxels.
void KeyframeDatabase::sort_by_place(std::vector<FixedPoint>& points) {
    constexpr int kPlaceBits = 13;  // two metres
    constexpr std::uint64_t kMask = (std::uint64_t{1} << 20) - 1;
    const auto part = [&](std::int32_t v) {
        return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v >> kPlaceBits)) & kMask;
    };
    places_.clear();
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        const FixedPoint& p = points[i];
        places_.emplace_back(part(p.x) << 40 | part(p.y) << 20 | part(p.z), i);
    }
    std::sort(places_.begin(), places_.end());
    sorted_.clear();
    for (const auto& [place, i] : places_) sorted_.push_back(points[i]);
    points.assign(sorted_.begin(), sorted_.end());
}

void KeyframeDatabase::find_bounds(Keyframe& keyframe) {
    keyframe.bounds.clear();
    for (std::size_t first = 0; first < keyframe.points.size(); first += kChunk) {
        const std::size_t last = std::min(first + kChunk, keyframe.points.size());
        constexpr auto kHigh = std::numeric_limits<std::int32_t>::max();
        constexpr auto kLow = std::numeric_limits<std::int32_t>::min();
        Bounds b{{kHigh, kHigh, kHigh}, {kLow, kLow, kLow}};
        for (std::size_t i = first; i < last; ++i) {
            const FixedPoint& p = keyframe.points[i];
            const std::int32_t at[3] = {p.x, p.y, p.z};
            for (std::size_t k = 0; k < 3; ++k) {
                b.low[k] = std::min(b.low[k], at[k]);
                b.high[k] = std::max(b.high[k], at[k]);
            }
        }
        keyframe.bounds.push_back(b);
    }
}

void KeyframeDatabase::set_provisional(const KeyframeCloud& cloud) {
    const bool alone =
        std::none_of(keyframes_.begin(), keyframes_.end(), [](const Keyframe& k) { return k.in_submap; });
    if (alone) {
        submap_.clear();
    } else {
        submap_.remove(provisional_);
    }
    convert(cloud, provisional_);
    submap_.add(provisional_);
}

void KeyframeDatabase::clear() {
    keyframes_.clear();
    announced_.clear();
    order_.clear();
    provisional_.clear();
    submap_.clear();
}

void KeyframeDatabase::forget_farthest(const Eigen::Vector3d& position_m) {
    const auto farthest =
        std::max_element(keyframes_.begin(), keyframes_.end(), [&](const Keyframe& a, const Keyframe& b) {
            return (a.position_m - position_m).squaredNorm() < (b.position_m - position_m).squaredNorm();
        });
    if (farthest->in_submap) submap_.remove(farthest->points);
    keyframes_.erase(farthest);
}

void KeyframeDatabase::remove_points(const OrientedBox& box) {
    const double reach = 0.5 * box.size_m.norm();
    const Eigen::Array3d low = (box.center_m.array() - reach) / kMapUnit_m;
    const Eigen::Array3d high = (box.center_m.array() + reach) / kMapUnit_m;
    if (!((low.abs() < kMaxFixed).all() && (high.abs() < kMaxFixed).all())) return;
    const Bounds around{
        {static_cast<std::int32_t>(low[0]), static_cast<std::int32_t>(low[1]), static_cast<std::int32_t>(low[2])},
        {static_cast<std::int32_t>(high[0]), static_cast<std::int32_t>(high[1]), static_cast<std::int32_t>(high[2])}};
    for (Keyframe& keyframe : keyframes_) {
        removed_.clear();
        std::size_t kept = 0;
        for (std::size_t chunk = 0; chunk < keyframe.bounds.size(); ++chunk) {
            const Bounds& b = keyframe.bounds[chunk];
            bool apart = false;
            for (std::size_t k = 0; k < 3; ++k) apart |= b.high[k] < around.low[k] || b.low[k] > around.high[k];
            const std::size_t first = chunk * kChunk;
            const std::size_t last = std::min(first + kChunk, keyframe.points.size());
            if (apart && kept == first) {
                kept = last;
                continue;
            }
            for (std::size_t i = first; i < last; ++i) {
                const FixedPoint p = keyframe.points[i];
                if (!apart && box.contains(Eigen::Vector3d(p.x, p.y, p.z) * kMapUnit_m)) {
                    removed_.push_back(p);
                } else {
                    if (kept != i) keyframe.points[kept] = p;
                    ++kept;
                }
            }
        }
        if (removed_.empty()) continue;
        if (keyframe.in_submap) submap_.remove(removed_);
        keyframe.points.resize(kept);
        find_bounds(keyframe);
    }
}

/// The nearest of those keyframes, as many as there may be.
void KeyframeDatabase::choose(std::size_t most, std::uint8_t Keyframe::*wanted) {
    for (std::size_t i = 0, taken = 0; i < order_.size() && taken < most; ++i) {
        if (!(keyframes_[order_[i].second].*wanted)) continue;
        chosen_[order_[i].second] = 1;
        ++taken;
    }
}

void KeyframeDatabase::update_hulls() {
    hulls_are_old_ = false;
    positions_.clear();
    for (Keyframe& keyframe : keyframes_) {
        positions_.push_back(keyframe.position_m);
        keyframe.on_convex_hull = keyframe.on_concave_hull = 0;
    }
    for (const std::size_t i : convex_hull(positions_)) keyframes_[i].on_convex_hull = 1;
    for (const std::size_t i : concave_hull(positions_, config_.concave_alpha_m)) keyframes_[i].on_concave_hull = 1;
}

void KeyframeDatabase::update_submap(const Eigen::Vector3d& position_m) {
    order_.clear();
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
        order_.emplace_back((keyframes_[i].position_m - position_m).squaredNorm(), i);
    }
    std::sort(order_.begin(), order_.end());
    chosen_.assign(keyframes_.size(), 0);
    const auto nearest = std::min(order_.size(), static_cast<std::size_t>(config_.nearest));
    for (std::size_t i = 0; i < nearest; ++i) chosen_[order_[i].second] = 1;
    if (hulls_are_old_) update_hulls();
    choose(static_cast<std::size_t>(config_.convex_hull), &Keyframe::on_convex_hull);
    choose(static_cast<std::size_t>(config_.concave_hull), &Keyframe::on_concave_hull);
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
        Keyframe& keyframe = keyframes_[i];
        if (keyframe.in_submap == (chosen_[i] != 0)) continue;
        keyframe.in_submap = chosen_[i] != 0;
        if (keyframe.in_submap) {
            submap_.add(keyframe.points);
        } else {
            submap_.remove(keyframe.points);
        }
    }
}

}  // namespace dlod
