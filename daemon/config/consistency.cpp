#include "daemon/config/consistency.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

#include "daemon/config/option.hpp"
#include "daemon/publish/lcm_url.hpp"
#include "driver/network_address.hpp"

namespace dlod::daemon {
namespace {

/// What LCM takes as the name of a channel.
constexpr std::size_t kLongestChannel = 63;
constexpr std::size_t kLongestSuffix = 14;  // POSE_PREDICTED

driver::IpAddress check_address(const char* key, const std::string& text) {
    const auto address = driver::parse_address(text);
    if (!address) throw ConfigError(fmt::format("{}: '{}' is no IPv4 or IPv6 address", key, text));
    return *address;
}

void check_configure(const SensorConfig& sensor) {
    const ConfigureSensorConfig& wanted = sensor.configure;
    for (const auto& [key, value] :
         {std::pair("udp_dest", &wanted.udp_dest), std::pair("lidar_mode", &wanted.lidar_mode),
          std::pair("lidar_profile", &wanted.lidar_profile), std::pair("timestamp_mode", &wanted.timestamp_mode)}) {
        if (!value->empty() && sensor.host.empty()) {
            throw ConfigError(fmt::format("sensor.configure.{}: needs sensor.host, which is asked to take it", key));
        }
    }
}

void check_sensor(const SensorConfig& sensor) {
    if (sensor.host.find_first_of("/ \t") != std::string::npos) {
        throw ConfigError(fmt::format(
            "sensor.host: '{}' is no name or address; as in os-122150001234.local, or 192.168.1.20", sensor.host));
    }
    if (sensor.lidar_port != 0 && sensor.lidar_port == sensor.imu_port) {
        throw ConfigError("sensor.imu_port: must differ from sensor.lidar_port");
    }
    if (!sensor.bind_address.empty()) check_address("sensor.bind_address", sensor.bind_address);
    if (!sensor.sender.empty()) check_address("sensor.sender", sensor.sender);
    if (!sensor.multicast_group.empty() &&
        !driver::is_multicast(check_address("sensor.multicast_group", sensor.multicast_group))) {
        throw ConfigError(fmt::format(
            "sensor.multicast_group: {} is no multicast address (224.0.0.0 to 239.255.255.255, or ff00::/8)",
            sensor.multicast_group));
    }
    if (sensor.share_ports && sensor.multicast_group.empty()) {
        throw ConfigError(
            "sensor.share_ports: needs sensor.multicast_group; where the sensor sends to this host alone, "
            "sensor.forward_to serves the other program");
    }
    if (!sensor.forward_to.empty() && !driver::parse_endpoint(sensor.forward_to)) {
        throw ConfigError(fmt::format("sensor.forward_to: '{}' is no address or address:port", sensor.forward_to));
    }
    check_configure(sensor);
}

void check_robot_body(const RobotBodyConfig& body) {
    if (body.boxes_m.size() % 6 != 0) {
        throw ConfigError(
            fmt::format("robot_body.boxes_m: it has {} numbers; a box has six: lowest x, y, z, highest "
                        "x, y, z",
                        body.boxes_m.size()));
    }
    const auto boxes = body.boxes();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (!(boxes[i].low_m.array() < boxes[i].high_m.array()).all()) {
            throw ConfigError(
                fmt::format("robot_body.boxes_m: box {}: its lowest corner must lie below its highest "
                            "one in x, y and z",
                            i + 1));
        }
    }
}

void check_lcm(const LcmConfig& lcm) {
    if (!lcm.url.empty() && lcm.url != "none" && !has_lcm_provider(lcm.url)) {
        throw ConfigError(
            fmt::format("lcm.url: '{}' is none of LCM's; write udpm://239.255.76.67:7667?ttl=1, or none", lcm.url));
    }
    if (lcm.url.starts_with("udpm://") && !multicast_group_of(lcm.url)) {
        throw ConfigError(fmt::format(
            "lcm.url: '{}' has no multicast address (224.0.0.0 to 239.255.255.255) with a port up to 65535", lcm.url));
    }
    if (!has_usable_server(lcm.url)) {
        throw ConfigError(fmt::format(
            "lcm.url: '{}': LCM finds the server by its IPv4 address only; as in tcpq://192.168.1.5:7700", lcm.url));
    }
    if (lcm.channel_prefix.size() > kLongestChannel - kLongestSuffix) {
        throw ConfigError(fmt::format("lcm.channel_prefix: it has {} characters; LCM's channels allow for {}",
                                      lcm.channel_prefix.size(), kLongestChannel - kLongestSuffix));
    }
    if (lcm.bot_core_channel.size() > kLongestChannel) {
        throw ConfigError(fmt::format("lcm.bot_core_channel: it has {} characters; LCM allows for {}",
                                      lcm.bot_core_channel.size(), kLongestChannel));
    }
}

}  // namespace

void check_consistency(const Config& config) {
    const auto& q = config.extrinsics.rotation_wxyz;
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (std::abs(norm - 1.0) > 1e-3) {
        throw ConfigError(fmt::format("extrinsics.rotation_wxyz: its norm is {:.6g}, a unit quaternion's is 1", norm));
    }
    check_sensor(config.sensor);
    check_robot_body(config.robot_body);
    check_lcm(config.lcm);
    const auto& obstacles = config.lcm.obstacles;
    if (obstacles.min_height_m >= obstacles.max_height_m) {
        throw ConfigError("lcm.obstacles.min_height_m: must be below lcm.obstacles.max_height_m");
    }
}

}  // namespace dlod::daemon
