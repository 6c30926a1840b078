#include "daemon/doctor/packet_check.hpp"

#include <fmt/format.h>

#include <optional>
#include <string>

#include "daemon/sensor/sensor_client.hpp"
#include "daemon/sensor/sensor_watch.hpp"
#include "daemon/sensor/udp_options.hpp"
#include "driver/frame_viewer.hpp"
#include "driver/udp_source.hpp"

namespace dlod::daemon {
namespace {

using Clock = std::chrono::steady_clock;
using Verdict = Check::Verdict;

constexpr const char* kName = "packets";

}  // namespace

PacketCount count_packets(const SensorConfig& config, const driver::SensorInfo& sensor,
                          std::chrono::milliseconds time) {
    driver::UdpSource source(udp_options(config, sensor));
    driver::FrameViewer frames(sensor);
    for (const auto end = Clock::now() + time; Clock::now() < end;) {
        for (const auto& packet : source.next().packets) frames.push(packet);
    }
    const auto& counters = frames.counters();
    return {.packets = counters.packets.value(),
            .lidar_packets = counters.lidar_packets.value(),
            .lost_packets = counters.lost_packets.value(),
            .kernel_drops = source.counters().kernel_drops.value(),
            .foreign = counters.foreign_packets.value(),
            .unfit = counters.wrong_size_packets.value() + counters.wrong_type_packets.value()};
}

Check judge_packets(const PacketCount& count, std::chrono::milliseconds time) {
    const double seconds = 1e-3 * static_cast<double>(time.count());
    const auto all = static_cast<double>(count.lidar_packets + count.lost_packets);
    if (count.packets == 0) {
        return {kName, Verdict::kFailure, fmt::format("none in {:.1f} s", seconds),
                "check the sensor's power and cable, its UDP destination (sensor.configure.udp_dest: '@auto' sets it), "
                "sensor.lidar_port, and the firewall: sudo nft list ruleset"};
    }
    if (count.lidar_packets == 0) {
        return {kName, Verdict::kFailure,
                fmt::format("{} in {:.1f} s, none of which fits the metadata ({} of another sensor, {} of another size "
                            "or type)",
                            count.packets, seconds, count.foreign, count.unfit),
                "give the metadata of this sensor: sensor.host, or curl http://SENSOR/api/v1/sensor/metadata"};
    }
    const std::string rate = fmt::format("{:.0f} lidar packets/s, {} of {:.0f} lost ({:.2f} %)",
                                         static_cast<double>(count.lidar_packets) / seconds, count.lost_packets, all,
                                         100.0 * static_cast<double>(count.lost_packets) / all);
    if (count.kernel_drops > 0) {
        return {kName, Verdict::kWarning, fmt::format("{}; {} in this host's receive buffer", rate, count.kernel_drops),
                "sudo sysctl -w net.core.rmem_max=33554432, and raise sensor.receive_buffer_bytes"};
    }
    if (count.lost_packets > 0) {
        return {kName, Verdict::kWarning, rate,
                "on the network: check cable and switch (1 Gbit/s, full duplex: ethtool INTERFACE) and its errors: "
                "ip -s link"};
    }
    if (count.foreign + count.unfit > 0) {
        return {kName, Verdict::kWarning,
                fmt::format("{}; {} packets of another sensor, {} of another size or type", rate, count.foreign,
                            count.unfit),
                "set sensor.sender to the sensor's address"};
    }
    return {kName, Verdict::kGood, rate, ""};
}

Check check_packets(const SensorConfig& config, std::chrono::milliseconds time) {
    if (config.metadata.empty() && config.host.empty()) {
        return {kName, Verdict::kWarning, "not looked for: no sensor is named", ""};
    }
    try {
        const auto file = configured_metadata(config);
        const SensorMetadata metadata =
            file ? *file : SensorMetadata{SensorClient(config.host).fetch_metadata(), "sensor " + config.host};
        const auto sensor = driver::parse_metadata(metadata.json, metadata.name);
        return judge_packets(count_packets(config, sensor, time), time);
    } catch (const SensorError& error) {
        return {kName, Verdict::kFailure, error.what(),
                "sensor.metadata: a file serves when the sensor does not answer"};
    } catch (const driver::MetadataError& error) {
        return {kName, Verdict::kFailure, error.what(), "curl http://SENSOR/api/v1/sensor/metadata > FILE"};
    } catch (const driver::SourceError& error) {
        const std::string text = error.what();
        if (text.find("in use") != std::string::npos) {
            return {kName, Verdict::kGood, "not looked for: " + text,
                    "where that is dlod, its status tells of losses: systemctl status dlod, or lcm-spy"};
        }
        return {kName, Verdict::kFailure, text, "check sensor.bind_address, sensor.multicast_group and the ports"};
    }
}

}  // namespace dlod::daemon
