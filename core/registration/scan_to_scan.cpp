#include "core/registration/scan_to_scan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dlod {
namespace {

constexpr float kNoiseVariance = 0.02F * 0.02F;  // m^2, of a point against the plane of a window of the scan before
constexpr float kKernel_m = 0.1F;

/// Angle of (x, y) to within 1e-4 of a turn, enough to find a cell.
float fast_atan2(float y, float x) {
    const float ax = std::abs(x);
    const float ay = std::abs(y);
    const float ratio = std::min(ax, ay) / std::max({ax, ay, 1e-9F});
    const float s = ratio * ratio;
    float angle = ((-0.0464964749F * s + 0.15931422F) * s - 0.327622764F) * s * ratio + ratio;
    if (ay > ax) angle = std::numbers::pi_v<float> / 2.0F - angle;
    if (x < 0.0F) angle = std::numbers::pi_v<float> - angle;
    return y < 0.0F ? -angle : angle;
}

}  // namespace

ScanToScan::ScanToScan(const ScanToScanConfig& config) : config_(config), grid_(kColumns * kRows) {
    set_.reserve(grid_.size());
}

int ScanToScan::cell_of(const float p[3]) {
    constexpr float kPi = std::numbers::pi_v<float>;
    const float azimuth = fast_atan2(p[1], p[0]);
    const float altitude = fast_atan2(p[2], std::sqrt(p[0] * p[0] + p[1] * p[1]));
    const int column = std::clamp(static_cast<int>((azimuth + kPi) * (kColumns / (2.0F * kPi))), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>((altitude + kPi / 2.0F) * (kRows / kPi)), 0, kRows - 1);
    return row * kColumns + column;
}

void ScanToScan::set_target(const PointSelection& points, std::span<const std::uint8_t> excluded,
                            const PlacedPoints& placed, const Eigen::Isometry3f& T_sensor_local) {
    for (const int cell : set_) grid_[static_cast<std::size_t>(cell)].set = false;
    set_.clear();
    const std::size_t count = excluded.empty() ? points.size() : excluded.size();
    for (std::size_t i = 0; i < count; ++i) {
        if (points.planarity[i] <= 0.0F || (!excluded.empty() && excluded[i])) continue;
        const Eigen::Vector3f p = T_sensor_local * Eigen::Vector3f(placed.x[i], placed.y[i], placed.z[i]);
        const Eigen::Vector3f n = T_sensor_local.linear() * Eigen::Vector3f(placed.nx[i], placed.ny[i], placed.nz[i]);
        if (n.isZero()) continue;
        const int cell = cell_of(p.data());
        Surfel& surfel = grid_[static_cast<std::size_t>(cell)];
        if (!surfel.set) set_.push_back(cell);
        std::copy_n(p.data(), 3, surfel.position);
        std::copy_n(n.data(), 3, surfel.normal);
        surfel.set = true;
    }
    filled_ = true;
}

void ScanToScan::match(const PointSelection& points, std::span<const std::uint8_t> excluded, const PlacedPoints& placed,
                       const Eigen::Isometry3f& T_target_local, double widening, PlaneMatches& matches) const {
    matches.reserve(points.pixel.capacity());
    matches.clear();
    const auto gate = static_cast<float>(config_.gate_m * widening);
    const auto kernel = kKernel_m * static_cast<float>(widening);
    const auto min_cosine = static_cast<float>(config_.min_normal_cosine);
    const Eigen::Matrix3f R_local_target = T_target_local.linear().transpose();
    // Flat points come first; the raw ones that make up for them have no normal to compare.
    std::size_t count = excluded.size();
    while (count > 0 && !points.is_flat(count - 1)) --count;
    const std::size_t step = std::max<std::size_t>(1, count / static_cast<std::size_t>(config_.points));
    for (std::size_t i = 0; i < count; i += step) {
        if (points.planarity[i] <= 0.0F || excluded[i]) continue;
        const Eigen::Vector3f p = T_target_local * Eigen::Vector3f(placed.x[i], placed.y[i], placed.z[i]);
        const int cell = cell_of(p.data());
        const Surfel& surfel = grid_[static_cast<std::size_t>(cell)];
        if (!surfel.set) continue;
        const Eigen::Vector3f d = p - Eigen::Map<const Eigen::Vector3f>(surfel.position);
        const Eigen::Vector3f n = R_local_target * Eigen::Map<const Eigen::Vector3f>(surfel.normal);
        const float residual = d.dot(Eigen::Map<const Eigen::Vector3f>(surfel.normal));
        if (std::abs(residual) > gate) continue;
        if (n.dot(Eigen::Vector3f(placed.nx[i], placed.ny[i], placed.nz[i])) < min_cosine) continue;
        const float fall = 1.0F / (1.0F + residual * residual / (kernel * kernel));
        const float lever[3] = {placed.lx[i], placed.ly[i], placed.lz[i]};
        matches.push(n.data(), lever, residual, points.planarity[i] * fall * fall / kNoiseVariance, points.time_s[i],
                     static_cast<std::uint32_t>(cell), static_cast<std::uint32_t>(i));
    }
    matches.flat = matches.count;
}

}  // namespace dlod
