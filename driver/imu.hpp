// The sensor's IMU packets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/types/imu_sample.hpp"

namespace dlod::driver {

/// The IMU profile that is decoded: one sample a packet, three times (system, accelerometer, gyroscope), g and degrees.
inline constexpr std::string_view kLegacyImuProfile = "LEGACY";
inline constexpr std::size_t kLegacyImuPacketBytes = 48;

/// The sample in a LEGACY IMU packet of kLegacyImuPacketBytes; its stamp is that of the gyroscope. Nothing where a
/// value is not finite or beyond what such an IMU can measure (50 g, 5000 deg/s), or the time is none
/// (ColumnClock::to_time).
std::optional<ImuSample> decode_imu_packet(std::span<const std::byte> packet);

/// Writes a LEGACY IMU packet of kLegacyImuPacketBytes whose accelerometer and gyroscope times are the sample's stamp.
void encode_imu_packet(std::span<std::byte> packet, const ImuSample& sample, std::int64_t system_time_ns);

}  // namespace dlod::driver
