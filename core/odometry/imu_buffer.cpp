#include "core/odometry/imu_buffer.hpp"

#include <algorithm>

namespace dlod {
namespace {

constexpr float kMaxAngularVelocity_radps = 50.0F;
constexpr float kMaxAcceleration_mps2 = 200.0F;
// Samples older than the newest one by more than this come from a clock that has been set back.
constexpr std::int64_t kClockStep_ns = 500'000'000;
// Between samples that are farther apart than this nothing is known.
constexpr std::int64_t kSilence_ns = 100'000'000;
constexpr std::int64_t kMean_ns = 1'000'000'000;
constexpr double kSpike_radps = 3.0;
constexpr double kSpike_mps2 = 60.0;

bool plausible(const ImuSample& s) {
    return s.angular_velocity_radps.allFinite() && s.acceleration_mps2.allFinite() &&
           s.angular_velocity_radps.cwiseAbs().maxCoeff() < kMaxAngularVelocity_radps &&
           s.acceleration_mps2.cwiseAbs().maxCoeff() < kMaxAcceleration_mps2;
}

}  // namespace

std::int64_t ImuBuffer::newest_ns() const {
    return count_ == 0 ? 0 : stored(count_ - 1).stamp_ns;
}
std::int64_t ImuBuffer::oldest_ns() const {
    return count_ == 0 ? 0 : stored(0).stamp_ns;
}

int ImuBuffer::add(std::span<const ImuSample> samples) {
    int taken = 0;
    for (const ImuSample& s : samples) {
        if (!plausible(s)) continue;
        if (count_ > 0 && s.stamp_ns < newest_ns() - kClockStep_ns) clear();
        if (count_ > 0 && s.stamp_ns <= (doubtful_ ? doubtful_->stamp_ns : newest_ns())) continue;
        const Stored sample{s.stamp_ns, {s.angular_velocity_radps.cast<double>(), s.acceleration_mps2.cast<double>()}};
        if (doubtful_) {
            // A spike stands out from the one before it and from the next one, which agree.
            const Reading& before = stored(count_ - 1).reading;
            const double jump = excess(before, doubtful_->reading);
            const double back = excess(doubtful_->reading, sample.reading);
            if (std::min(jump, back) < 2.0 * excess(before, sample.reading)) {
                store(*doubtful_);
                ++taken;
            }
            doubtful_.reset();
        }
        if (count_ > 0 && excess(stored(count_ - 1).reading, sample.reading) > 1.0) {
            doubtful_ = sample;
            continue;
        }
        store(sample);
        ++taken;
    }
    return taken;
}

void ImuBuffer::clear() {
    count_ = 0;
    doubtful_.reset();
}

void ImuBuffer::store(const Stored& sample) {
    if (count_ == kCapacity) {
        first_ = (first_ + 1) % kCapacity;
        --count_;
    }
    samples_[(first_ + count_) % kCapacity] = sample;
    ++count_;
}

/// How far apart two samples are; beyond 1 the second one has to be borne out by a third.
double ImuBuffer::excess(const Reading& a, const Reading& b) {
    return std::max((b.angular_velocity_radps - a.angular_velocity_radps).norm() / kSpike_radps,
                    (b.acceleration_mps2 - a.acceleration_mps2).norm() / kSpike_mps2);
}

Eigen::Vector3d ImuBuffer::turn(std::int64_t from_ns, std::int64_t to_ns) const {
    constexpr int kSteps = 40;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < kSteps; ++i)
        sum += at(from_ns + (to_ns - from_ns) * (2 * i + 1) / (2 * kSteps)).angular_velocity_radps;
    return sum / kSteps * (static_cast<double>(to_ns - from_ns) * 1e-9);
}

bool ImuBuffer::is_silent_at(std::int64_t time_ns) const {
    if (time_ns >= newest_ns()) return time_ns - newest_ns() > kSilence_ns;
    std::size_t i = count_ - 1;
    while (i > 0 && stored(i - 1).stamp_ns > time_ns) --i;
    return i > 0 && stored(i).stamp_ns - stored(i - 1).stamp_ns > kSilence_ns;
}

Eigen::Vector3d ImuBuffer::mean_rate_before(std::int64_t time_ns) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int samples = 0;
    std::int64_t last_ns = time_ns;
    for (std::size_t i = count_; i-- > 0;) {
        const Stored& s = stored(i);
        if (s.stamp_ns > time_ns) continue;
        if (samples == 0) last_ns = s.stamp_ns;
        if (last_ns - s.stamp_ns > kMean_ns) break;
        sum += s.reading.angular_velocity_radps;
        ++samples;
    }
    return sum / std::max(1, samples);
}

ImuBuffer::Reading ImuBuffer::at(std::int64_t time_ns) const {
    if (time_ns <= stored(0).stamp_ns) return stored(0).reading;
    if (time_ns >= newest_ns()) return stored(count_ - 1).reading;
    std::size_t i = count_ - 1;  // recent times are asked for most
    while (stored(i - 1).stamp_ns > time_ns) --i;
    const Stored& a = stored(i - 1);
    const Stored& b = stored(i);
    const double f = static_cast<double>(time_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns);
    return {
        a.reading.angular_velocity_radps + f * (b.reading.angular_velocity_radps - a.reading.angular_velocity_radps),
        a.reading.acceleration_mps2 + f * (b.reading.acceleration_mps2 - a.reading.acceleration_mps2)};
}

}  // namespace dlod
