#include "core/odometry/imu_monitor.hpp"

#include <algorithm>

namespace dlod {
namespace {

constexpr double kSilence_s = 0.1;
constexpr std::size_t kStuckSamples = 5;  // equal to the last bit, noise makes that impossible
constexpr double kMaxRefusedShare = 0.1;
constexpr int kMaxWaitFrames = 640;
// A correction beyond both the deviation and the absolute bound is impossible; a smaller one is suspicious and adds up.
constexpr double kImpossibleDeviations = 10.0;
constexpr double kImpossibleRotation_rad = 0.03;
constexpr double kImpossibleVelocity_mps = 1.0;
constexpr double kSuspiciousShare = 0.25;
constexpr double kDisagreementLimit = 4.0;
constexpr double kDisagreementDecay = 0.8;
constexpr double kMaxTurnDifference_rad = 0.01;

bool same(const ImuSample& a, const ImuSample& b) {
    return a.acceleration_mps2 == b.acceleration_mps2 && a.angular_velocity_radps == b.angular_velocity_radps;
}

}  // namespace

void ImuMonitor::fail() {
    if (!faulty_) wait_frames_ = std::min(2 * wait_frames_, kMaxWaitFrames);
    faulty_ = true;
    clean_frames_ = 0;
    disagreement_ = 0.0;
}

void ImuMonitor::see_samples(std::span<const ImuSample> samples, int taken, std::int64_t newest_ns,
                             std::int64_t stamp_ns) {
    if (taken > 0) present_ = true;
    if (!present_) return;
    const bool silent = static_cast<double>(stamp_ns - newest_ns) * 1e-9 > kSilence_s;
    const bool stuck =
        samples.size() >= kStuckSamples &&
        std::all_of(samples.begin(), samples.end(), [&](const ImuSample& s) { return same(s, samples[0]); });
    const auto refused = static_cast<double>(samples.size()) - taken;
    clean_ = !silent && !stuck && refused <= kMaxRefusedShare * static_cast<double>(samples.size());
    if (!clean_) fail();
}

bool ImuMonitor::see_correction(const Eigen::Vector3d& rotation_rad, double rotation_deviation_rad,
                                const Eigen::Vector3d& velocity_mps, double velocity_deviation_mps) {
    // 1: at the bound of what is possible.
    const double rotation = std::min(rotation_rad.norm() / kImpossibleRotation_rad,
                                     rotation_rad.norm() / (kImpossibleDeviations * rotation_deviation_rad));
    const double velocity = std::min(velocity_mps.norm() / kImpossibleVelocity_mps,
                                     velocity_mps.norm() / (kImpossibleDeviations * velocity_deviation_mps));
    const double worst = std::max(rotation, velocity);
    disagreement_ = kDisagreementDecay * disagreement_ + (worst > kSuspiciousShare ? worst : 0.0);
    if (worst <= 1.0 && disagreement_ <= kDisagreementLimit) return true;
    fail();
    return false;
}

void ImuMonitor::see_turns(const Eigen::Vector3d& gyro_rad, const Eigen::Vector3d& lidar_rad) {
    if (!faulty_) return;
    clean_frames_ = clean_ && (gyro_rad - lidar_rad).norm() < kMaxTurnDifference_rad ? clean_frames_ + 1 : 0;
    if (clean_frames_ >= wait_frames_) faulty_ = false;
}

}  // namespace dlod
