// The sensor's own HTTP interface (Ouster firmware 2.2 and later): its metadata, and the few settings that dlod may
// make.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace dlod::daemon {

/// The sensor could not be asked, or refused; the text names host, request and what to do.
class SensorError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// What to set on the sensor, or what is in force there; only what has a value is sent or known.
struct SensorSettings {
    std::optional<std::string> udp_dest;  ///< address, or "@auto": the host that asks
    std::optional<std::uint16_t> lidar_port;
    std::optional<std::uint16_t> imu_port;
    std::optional<std::string> lidar_mode;      ///< "1024x10"
    std::optional<std::string> lidar_profile;   ///< "RNG15_RFL8_NIR8"
    std::optional<std::string> timestamp_mode;  ///< "TIME_FROM_PTP_1588"

    bool empty() const {
        return !udp_dest && !lidar_port && !imu_port && !lidar_mode && !lidar_profile && !timestamp_mode;
    }
};

/// What of `wanted` is not in force in `active`.
/// @param own_address of this host as the sensor sees it: what the destination "@auto" stands for
SensorSettings difference(const SensorSettings& wanted, const SensorSettings& active, const std::string& own_address);
/// In words: "udp_dest 10.0.0.9 instead of @auto, lidar_mode 512x10 instead of 1024x10".
std::string describe_difference(const SensorSettings& missing, const SensorSettings& active);

/// The state that metadata carry, "RUNNING" where they carry none.
std::string status_of(const std::string& metadata);

/// One request, one connection: the sensor may be unplugged between any two. Whatever answers, a request takes no more
/// than a few timeouts and megabytes.
class SensorClient {
  public:
    /// @param host name or address, with `:port` where it is not 80; IPv6 addresses in brackets
    explicit SensorClient(std::string host, std::chrono::milliseconds timeout = std::chrono::seconds(3));

    /// The metadata JSON of GET /api/v1/sensor/metadata.
    /// @throws SensorError when the sensor does not answer, answers with an error, or is still starting
    std::string fetch_metadata() const;

    /// What is in force of the settings (GET /api/v1/sensor/cmd/get_config_param?args=active).
    /// @throws SensorError
    SensorSettings fetch_settings() const;

    /// This host's address on the way to the sensor; empty where none leads there.
    std::string own_address() const;

    /// Makes the settings take effect (POST /api/v1/sensor/config?reinit=true&persist=false). The sensor restarts its
    /// stream; nothing survives its next power cycle.
    /// @throws SensorError
    void apply(const SensorSettings& settings) const;

    const std::string& host() const { return host_; }

  private:
    std::string host_;
    std::chrono::milliseconds timeout_;
};

}  // namespace dlod::daemon
