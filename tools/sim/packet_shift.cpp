#include "tools/sim/packet_shift.hpp"

#include "driver/imu.hpp"

namespace dlod::tools::sim {

void shift_lidar_packet(std::span<std::byte> packet, const driver::PacketLayout& layout, const PacketShift& shift) {
    if (packet.size() != layout.packet_bytes()) return;
    driver::PacketHeader header = layout.read_packet_header(packet);
    if (header.type != driver::kLidarPacketType) return;
    header.frame_id += shift.frames;
    header.init_id += shift.initializations;
    layout.write_packet_header(packet, header);
    for (int c = 0; c < layout.columns(); ++c) {
        driver::ColumnHeader column = layout.read_column_header(packet, c);
        column.time_ns += static_cast<std::uint64_t>(shift.time_ns);
        column.frame_id = static_cast<std::uint16_t>(column.frame_id + shift.frames);
        layout.write_column_header(packet, c, column);
    }
}

void shift_imu_packet(std::span<std::byte> packet, const PacketShift& shift) {
    if (const auto sample = driver::decode_imu_packet(packet)) {
        ImuSample moved = *sample;
        moved.stamp_ns += shift.time_ns;
        driver::encode_imu_packet(packet, moved, moved.stamp_ns);
    }
}

}  // namespace dlod::tools::sim
