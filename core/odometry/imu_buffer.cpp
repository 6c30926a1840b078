#include "core/odometry/imu_buffer.hpp"

#include <algorithm>

namespace dlod {
namespace {

constexpr float kMaxAngularVelocity_radps = 50.0F;
constexpr float kMaxAcceleration_mps2 = 200.0F;

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
        if (!plausible(s) || (count_ > 0 && s.stamp_ns <= newest_ns())) continue;
        if (count_ == kCapacity) {
            first_ = (first_ + 1) % kCapacity;
            --count_;
        }
        samples_[(first_ + count_) % kCapacity] = {
            s.stamp_ns, {s.angular_velocity_radps.cast<double>(), s.acceleration_mps2.cast<double>()}};
        ++count_;
        ++taken;
    }
    return taken;
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
