#include "driver/imu.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

#include "driver/column_clock.hpp"

namespace dlod::driver {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian and read in place");

constexpr std::size_t kSystemTime = 0;
constexpr std::size_t kAccelerometerTime = 8;
constexpr std::size_t kGyroscopeTime = 16;
constexpr std::size_t kAcceleration = 24;
constexpr std::size_t kAngularVelocity = 36;

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
constexpr float kMaximumAcceleration_g = 50.0F;
constexpr float kMaximumAngularVelocity_dps = 5000.0F;

bool plausible(const Eigen::Vector3f& v, float limit) {
    return v.allFinite() && v.cwiseAbs().maxCoeff() <= limit;
}

}  // namespace

std::optional<ImuSample> decode_imu_packet(std::span<const std::byte> packet) {
    std::uint64_t time = 0;
    Eigen::Vector3f acceleration_g;
    Eigen::Vector3f angular_velocity_dps;
    std::memcpy(&time, packet.data() + kGyroscopeTime, sizeof(time));
    std::memcpy(acceleration_g.data(), packet.data() + kAcceleration, 3 * sizeof(float));
    std::memcpy(angular_velocity_dps.data(), packet.data() + kAngularVelocity, 3 * sizeof(float));
    if (!plausible(acceleration_g, kMaximumAcceleration_g)) return std::nullopt;
    if (!plausible(angular_velocity_dps, kMaximumAngularVelocity_dps)) return std::nullopt;
    ImuSample sample;
    sample.stamp_ns = ColumnClock::to_time(time);
    if (sample.stamp_ns < 0) return std::nullopt;
    sample.acceleration_mps2 = (acceleration_g.cast<double>() * kStandardGravity_mps2).cast<float>();
    sample.angular_velocity_radps = (angular_velocity_dps.cast<double>() * kRadiansPerDegree).cast<float>();
    return sample;
}

void encode_imu_packet(std::span<std::byte> packet, const ImuSample& sample, std::int64_t system_time_ns) {
    const Eigen::Vector3f acceleration_g =
        (sample.acceleration_mps2.cast<double>() / kStandardGravity_mps2).cast<float>();
    const Eigen::Vector3f angular_velocity_dps =
        (sample.angular_velocity_radps.cast<double>() / kRadiansPerDegree).cast<float>();
    std::memcpy(packet.data() + kSystemTime, &system_time_ns, sizeof(system_time_ns));
    std::memcpy(packet.data() + kAccelerometerTime, &sample.stamp_ns, sizeof(sample.stamp_ns));
    std::memcpy(packet.data() + kGyroscopeTime, &sample.stamp_ns, sizeof(sample.stamp_ns));
    std::memcpy(packet.data() + kAcceleration, acceleration_g.data(), 3 * sizeof(float));
    std::memcpy(packet.data() + kAngularVelocity, angular_velocity_dps.data(), 3 * sizeof(float));
}

}  // namespace dlod::driver
