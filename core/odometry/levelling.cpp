#include "core/odometry/levelling.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace dlod {
namespace {

// From this scan on the motion is known well enough for a map.
constexpr int kFirstGoodScan = 2;
// How well the level has to be known.
constexpr double kLevel_rad = 0.035;
constexpr double kMaxDeviation_mps2 = kLevel_rad * kStandardGravity_mps2;
// Of what comes out as gravity: accelerometers are off by some hundredths of it.
constexpr double kMaxGravityError_mps2 = 0.6;
// A start that leaves more of the positions unexplained is tried again, so many times.
constexpr double kMaxScatter = 1.0;
constexpr int kMaxRetries = 3;

}  // namespace

Eigen::Matrix3d levelled(const Eigen::Vector3d& up) {
    const Eigen::Vector3d left = up.cross(Eigen::Vector3d::UnitX()).normalized();
    Eigen::Matrix3d R;
    R << left.cross(up).normalized().transpose(), left.transpose(), up.normalized().transpose();
    return R;
}

void Levelling::begin_map() {
    scans_ = 0;
    start_level_.clear();
}

Levelling::Next Levelling::see_scan(const MotionFilter& filter, const ImuBuffer& imu, bool degenerate) {
    if (++scans_ < kFirstGoodScan) return Next::kWait;
    if (degenerate) {
        start_level_.clear();
        return Next::kWait;
    }
    start_level_.add(filter.state(), filter.stamp_ns(), imu);
    if (scans_ == kFirstGoodScan) return Next::kRenewMap;
    const auto gravity = start_level_.gravity();
    if (!gravity || gravity->deviation_mps2 > kMaxDeviation_mps2) return Next::kWait;
    const bool is_gravity = std::abs(gravity->mps2.norm() - kStandardGravity_mps2) < kMaxGravityError_mps2;
    if ((!is_gravity || gravity->scatter > kMaxScatter) && retries_ < kMaxRetries) {
        ++retries_;
        return Next::kStartAgain;
    }
    if (std::sqrt(gravity->scatter) * gravity->deviation_mps2 > kMaxDeviation_mps2) return Next::kWait;
    known_ = true;
    return Next::kBeginWorld;
}

}  // namespace dlod
