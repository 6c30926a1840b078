#include "driver/port_selection.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "driver/pcap_source.hpp"

namespace dlod::driver {
namespace {

constexpr std::int64_t kScan_ns = 2'000'000'000;

/// Packets seen by destination port and payload size.
using Tally = std::map<std::pair<std::uint16_t, std::size_t>, std::uint64_t>;

struct Choice {
    std::uint16_t port = 0;
    bool found = false;
};

Choice choose(const Tally& tally, std::uint16_t wanted, std::size_t bytes) {
    if (tally.contains({wanted, bytes})) return {wanted, true};
    Choice best{wanted, false};
    std::uint64_t most = 0;
    for (const auto& [key, count] : tally) {
        if (key.second != bytes || count <= most) continue;
        best = {key.first, true};
        most = count;
    }
    return best;
}

std::string list(const Tally& tally) {
    constexpr std::size_t kLongest = 8;
    std::string text;
    std::size_t n = 0;
    for (const auto& [key, count] : tally) {
        if (n++ == kLongest) return text + ", ...";
        text += (text.empty() ? "" : ", ") + std::to_string(count) + " of " + std::to_string(key.second) +
                " bytes to port " + std::to_string(key.first);
    }
    return text.empty() ? "no UDP packets" : text;
}

}  // namespace

PortSelection select_ports(const std::filesystem::path& capture, const ExpectedPackets& expected) {
    PcapSource source(capture);
    Tally tally;
    std::optional<std::int64_t> first_lidar_ns;
    for (PacketBatch batch = source.next(); batch.status == SourceStatus::kPackets; batch = source.next()) {
        for (const Packet& packet : batch.packets) {
            ++tally[{packet.destination_port, packet.data.size()}];
            if (!first_lidar_ns && packet.data.size() == expected.lidar_bytes) first_lidar_ns = packet.receive_ns;
        }
        const bool both = tally.contains({expected.lidar_port, expected.lidar_bytes}) &&
                          tally.contains({expected.imu_port, expected.imu_bytes});
        if (both || (first_lidar_ns && batch.packets.back().receive_ns - *first_lidar_ns > kScan_ns)) break;
    }

    const Choice lidar = choose(tally, expected.lidar_port, expected.lidar_bytes);
    const Choice imu = choose(tally, expected.imu_port, expected.imu_bytes);
    PortSelection selection{lidar.port, imu.port, lidar.found, imu.found, {}};
    const auto differs = [&](const char* what, std::uint16_t wanted, std::uint16_t port) {
        selection.warnings.push_back(capture.string() + ": no " + what + " packets to port " + std::to_string(wanted) +
                                     " of the metadata; taking those to port " + std::to_string(port));
    };
    if (source.counters().records.value() == 0) return selection;  // nothing is wrong with the metadata
    if (!lidar.found) {
        selection.warnings.push_back(
            capture.string() + ": no lidar packets of " + std::to_string(expected.lidar_bytes) +
            " bytes, as the metadata has them; is it the metadata of this capture? It has " + list(tally));
    } else if (lidar.port != expected.lidar_port) {
        differs("lidar", expected.lidar_port, lidar.port);
    }
    if (imu.found && imu.port != expected.imu_port) differs("IMU", expected.imu_port, imu.port);
    return selection;
}

}  // namespace dlod::driver
