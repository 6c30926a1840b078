#include "core/odometry/start_level.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr double kStep_s = 2.5e-3;
constexpr double kPosition_m = 0.005;  // standard deviation of a registered position
constexpr std::size_t kLeast = 4;

}  // namespace

void StartLevel::add(const MotionState& state, std::int64_t stamp_ns, const ImuBuffer& imu) {
    if (positions_.empty()) {
        first_ns_ = last_ns_ = stamp_ns;
        way_m_.setZero();
        velocity_mps_.setZero();
    }
    const double duration_s = static_cast<double>(stamp_ns - last_ns_) * 1e-9;
    const int steps = static_cast<int>(std::ceil(duration_s / kStep_s));
    const double h = duration_s / std::max(1, steps);
    for (int i = 0; i < steps; ++i) {
        const ImuBuffer::Reading reading = imu.at(last_ns_ + std::llround((i + 0.5) * h * 1e9));
        const Eigen::Vector3d rate = reading.angular_velocity_radps - state.rate_radps;
        const Eigen::Vector3d force = rotation_ * so3_exp(0.5 * h * rate) * reading.acceleration_mps2;
        rotation_ = (rotation_ * so3_exp(h * rate)).normalized();
        way_m_ += h * velocity_mps_ + 0.5 * h * h * force;
        velocity_mps_ += h * force;
    }
    last_ns_ = stamp_ns;
    rotation_ = state.rotation;
    if (positions_.size() == kMost) positions_.erase(positions_.begin());
    positions_.push_back({static_cast<double>(stamp_ns - first_ns_) * 1e-9, state.position_m - way_m_});
}

std::optional<StartLevel::Gravity> StartLevel::gravity() const {
    if (positions_.size() < kLeast) return std::nullopt;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d right = Eigen::Matrix3d::Zero();
    const Position& first = positions_.front();
    const auto row = [&](const Position& p) {
        const double t = p.time_s - first.time_s;
        return Eigen::Vector3d(1.0, t, 0.5 * t * t);
    };
    const auto moved = [&](const Position& p) { return Eigen::Vector3d(p.unexplained_m - first.unexplained_m); };
    for (const Position& p : positions_) {
        normal += row(p) * row(p).transpose();
        right += row(p) * moved(p).transpose();
    }
    const Eigen::Matrix3d inverse = normal.inverse();
    const Eigen::Matrix3d solution = inverse * right;
    double squares = 0.0;
    for (const Position& p : positions_) squares += (solution.transpose() * row(p) - moved(p)).squaredNorm();
    const double degrees_of_freedom = 3.0 * static_cast<double>(positions_.size() - 3);
    return Gravity{solution.row(2).transpose(), kPosition_m * std::sqrt(inverse(2, 2)),
                   squares / (kPosition_m * kPosition_m * degrees_of_freedom)};
}

}  // namespace dlod
