#include "core/odometry/imu_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr double kSilence_s = 0.1;
// Samples are handed over with the frame in which they came: farther ahead of it their clock is another one.
constexpr double kMaxAhead_s = 0.5;
constexpr std::size_t kStuckSamples = 5;  // equal to the last bit, noise makes that impossible
constexpr double kMaxRefusedShare = 0.1;
constexpr int kMaxWaitFrames = 640;
// A correction beyond both the deviation and the absolute bound is impossible; a smaller one is suspicious and adds up.
constexpr double kImpossibleDeviations = 10.0;
// The lidar sees a position directly: less is needed.
constexpr double kImpossiblePosition_m = 0.05;
constexpr double kPositionDeviations = 4.0;
constexpr double kImpossibleRotation_rad = 0.03;
constexpr double kImpossibleVelocity_mps = 1.0;
constexpr double kSuspiciousShare = 0.25;
constexpr double kDisagreementLimit = 4.0;
constexpr double kDisagreementDecay = 0.8;
constexpr double kMaxTurnDifference_rad = 0.01;
constexpr double kMaxForceDifference_mps2 = 2.0;
// At rest: the mean turn rate is a bias, and what is around the means is the IMU's own noise.
constexpr float kQuietRate_radps = 0.02F;
constexpr float kQuietRateNoise_radps = 0.01F;
constexpr float kQuietNoise_mps2 = 0.1F;
constexpr float kQuietChange_mps2 = 0.04F;
constexpr std::size_t kLastSamples = 3;
constexpr int kMaxQuietFrames = 100;

bool same(const ImuSample& a, const ImuSample& b) {
    return a.acceleration_mps2 == b.acceleration_mps2 && a.angular_velocity_radps == b.angular_velocity_radps;
}

/// 1: at the bound of what is possible.
double share_of_possible(double correction, double impossible, double deviations, double deviation) {
    return std::min(correction / impossible, correction / (deviations * deviation));
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
    const double age_s = static_cast<double>(stamp_ns - newest_ns) * 1e-9;
    const bool silent = age_s > kSilence_s || age_s < -kMaxAhead_s;
    const bool stuck =
        samples.size() >= kStuckSamples &&
        std::all_of(samples.begin(), samples.end(), [&](const ImuSample& s) { return same(s, samples[0]); });
    const auto refused = static_cast<double>(samples.size()) - taken;
    see_rest(samples);
    clean_ = !silent && !stuck && refused <= kMaxRefusedShare * static_cast<double>(samples.size());
    if (!clean_) fail();
}

/// Counts frames at rest: no turn, no vibration, and the same force as in those before.
void ImuMonitor::see_rest(std::span<const ImuSample> samples) {
    const auto n = static_cast<float>(samples.size());
    Eigen::Vector3f rate = Eigen::Vector3f::Zero();
    Eigen::Vector3f force = Eigen::Vector3f::Zero();
    for (const ImuSample& s : samples) {
        rate += s.angular_velocity_radps / n;
        force += s.acceleration_mps2 / n;
    }
    float rate_squares = 0.0F;
    float force_squares = 0.0F;
    for (const ImuSample& s : samples) {
        rate_squares += (s.angular_velocity_radps - rate).squaredNorm() / (3.0F * n);
        force_squares += (s.acceleration_mps2 - force).squaredNorm() / (3.0F * n);
    }
    const bool still = samples.size() >= kStuckSamples && rate.norm() < kQuietRate_radps &&
                       rate_squares < kQuietRateNoise_radps * kQuietRateNoise_radps &&
                       force_squares < kQuietNoise_mps2 * kQuietNoise_mps2;
    // The last samples tell first that a motion begins.
    Eigen::Vector3f last_force = Eigen::Vector3f::Zero();
    const auto last = samples.last(std::min(samples.size(), kLastSamples));
    for (const ImuSample& s : last) last_force += s.acceleration_mps2 / static_cast<float>(last.size());
    const bool same_force = quiet_frames_ == 0 || ((force - rest_force_mps2_).norm() < kQuietChange_mps2 &&
                                                   (last_force - rest_force_mps2_).norm() < 1.5F * kQuietChange_mps2);
    if (!still || !same_force) {
        quiet_frames_ = 0;
        return;
    }
    quiet_frames_ = std::min(quiet_frames_ + 1, kMaxQuietFrames);
    rest_force_mps2_ += (force - rest_force_mps2_) / static_cast<float>(quiet_frames_);
}

bool ImuMonitor::is_impossible_position(const Correction& c) {
    return share_of_possible(c.position_m, kImpossiblePosition_m, kPositionDeviations, c.position_deviation_m) > 1.0;
}

bool ImuMonitor::see_correction(const Correction& c) {
    const double rotation =
        share_of_possible(c.rotation_rad, kImpossibleRotation_rad, kImpossibleDeviations, c.rotation_deviation_rad);
    const double velocity =
        share_of_possible(c.velocity_mps, kImpossibleVelocity_mps, kImpossibleDeviations, c.velocity_deviation_mps);
    const double worst = std::max(rotation, velocity);
    disagreement_ = kDisagreementDecay * disagreement_ + (worst > kSuspiciousShare ? worst : 0.0);
    if (worst <= 1.0 && !is_impossible_position(c) && disagreement_ <= kDisagreementLimit) return true;
    fail();
    return false;
}

void ImuMonitor::see_motion(const Eigen::Vector3d& turn_difference_rad, double force_difference_mps2) {
    if (!faulty_) return;
    const bool agrees = turn_difference_rad.norm() < kMaxTurnDifference_rad &&
                        std::abs(force_difference_mps2) < kMaxForceDifference_mps2;
    clean_frames_ = clean_ && agrees ? clean_frames_ + 1 : 0;
    if (clean_frames_ >= wait_frames_) faulty_ = false;
}

}  // namespace dlod
