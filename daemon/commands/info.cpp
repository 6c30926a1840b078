#include <cstdio>

#include "daemon/commands/capture_metadata.hpp"
#include "daemon/commands/commands.hpp"
#include "driver/frame_viewer.hpp"
#include "driver/metadata.hpp"
#include "driver/pcap_source.hpp"

namespace dlod::daemon {
namespace {

/// Metadata of old firmware, or written by hand, do not tell everything.
const char* or_unknown(const std::string& text) {
    return text.empty() ? "unknown" : text.c_str();
}

void print_sensor(const driver::SensorInfo& sensor) {
    const auto& model = sensor.model;
    std::printf("sensor    %s, serial %s, firmware %s\n", or_unknown(sensor.product_line),
                or_unknown(sensor.serial_number), or_unknown(sensor.firmware));
    std::printf("mode      %s: %d x %d, %.0f Hz, columns %d to %d\n", or_unknown(sensor.lidar_mode), model.height,
                model.width, 1.0 / model.frame_period_s, model.column_window_first, model.column_window_last);
    std::printf("profile   %s, IMU %s, %d columns a packet\n", sensor.profile_name.c_str(),
                sensor.imu_profile_name.empty() ? "LEGACY" : sensor.imu_profile_name.c_str(),
                sensor.columns_per_packet);
    std::printf("ports     lidar %d, IMU %d\n", sensor.lidar_port, sensor.imu_port);
    std::printf("clock     %s\n", or_unknown(sensor.timestamp_mode));
    for (const auto& warning : sensor.warnings) std::printf("warning   %s\n", warning.c_str());
}

void print_capture(const std::filesystem::path& file, const driver::SensorInfo& sensor) {
    driver::PcapSource source(file);
    driver::FrameViewer frames(sensor);
    std::int64_t first_ns = 0;
    std::int64_t last_ns = 0;
    for (auto batch = source.next(); batch.status != driver::SourceStatus::kEnd; batch = source.next()) {
        for (const auto& packet : batch.packets) {
            if (first_ns == 0) first_ns = packet.receive_ns;
            last_ns = packet.receive_ns;
            frames.push(packet);
        }
    }
    frames.flush();
    for (const auto& warning : source.take_warnings()) std::printf("warning   %s\n", warning.c_str());
    std::printf("duration  %.3f s\n", 1e-9 * static_cast<double>(last_ns - first_ns));
    // Zeros say nothing but the totals'.
    const driver::CounterVisitor print = [](std::string_view name, std::uint64_t value) {
        if (value == 0 && name != "packets" && name != "frames") return;
        std::printf("  %-22.*s %llu\n", static_cast<int>(name.size()), name.data(),
                    static_cast<unsigned long long>(value));
    };
    std::printf("capture\n");
    source.visit_counters(print);
    std::printf("packets and frames\n");
    frames.counters().visit(print);
}

}  // namespace

ExitCode info(const std::filesystem::path& file, const std::optional<std::filesystem::path>& metadata) {
    if (file.extension() == ".json") {
        print_sensor(driver::load_metadata(file));
        return ExitCode::kSuccess;
    }
    const auto sensor = load_capture_metadata(file, metadata);
    print_sensor(sensor);
    print_capture(file, sensor);
    return ExitCode::kSuccess;
}

}  // namespace dlod::daemon
