#include "daemon/sensor/udp_options.hpp"

namespace dlod::daemon {

driver::UdpOptions udp_options(const SensorConfig& config, const driver::SensorInfo& sensor) {
    const auto port = [](int configured, std::uint16_t other) {
        return configured != 0 ? static_cast<std::uint16_t>(configured) : other;
    };
    driver::UdpOptions options;
    options.ports = {port(config.lidar_port, sensor.lidar_port), port(config.imu_port, sensor.imu_port)};
    options.bind_address = config.bind_address;
    options.multicast_group = config.multicast_group;
    options.interface = config.interface;
    if (!config.sender.empty()) options.senders = {config.sender};
    options.share_ports = config.share_ports;
    options.forward_to = config.forward_to;
    options.receive_buffer_bytes = config.receive_buffer_bytes;
    return options;
}

}  // namespace dlod::daemon
