#include "tests/support/synthetic_capture.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "driver/imu.hpp"
#include "driver/packet_format.hpp"
#include "driver/pcap_writer.hpp"

namespace dlod::test {
namespace {

constexpr int kColumnsPerPacket = 16;
constexpr double kFramePeriod = 0.1;

double altitude_deg(const SyntheticSensor& sensor, int row) {
    return 22.0 - 44.0 * row / (sensor.rows - 1);
}

/// Distance along the ray to the hall's walls, floor or the walking person; the ray's origin is inside.
double range_m(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double time_s) {
    const Eigen::Vector3d low(-8.0, -6.0, -0.9);
    const Eigen::Vector3d high(16.0, 7.0, 4.0);
    double nearest = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(direction[axis]) < 1e-9) continue;
        const double wall = direction[axis] > 0.0 ? high[axis] : low[axis];
        nearest = std::min(nearest, (wall - origin[axis]) / direction[axis]);
    }
    // Pillars along the walls make the way along the hall observable; the person is one that walks across.
    struct Pillar {
        double x, y, radius, top;
    };
    const Pillar pillars[] = {{-3.0, -4.0, 0.5, 4.0},
                              {4.0, 4.5, 0.6, 4.0},
                              {9.0, -3.5, 0.4, 4.0},
                              {13.0, 3.0, 0.5, 4.0},
                              {5.0, -3.0 + 1.2 * time_s, 0.25, 0.85}};
    for (const auto& pillar : pillars) {
        const Eigen::Vector2d to(pillar.x - origin.x(), pillar.y - origin.y());
        const Eigen::Vector2d along(direction.x(), direction.y());
        const double a = along.squaredNorm();
        const double b = to.dot(along);
        const double c = to.squaredNorm() - pillar.radius * pillar.radius;
        const double root = b * b - a * c;
        if (root < 0.0) continue;
        const double t = (b - std::sqrt(root)) / a;
        if (t > 0.0 && origin.z() + t * direction.z() < pillar.top) nearest = std::min(nearest, t);
    }
    return nearest;
}

std::vector<std::byte> lidar_packet(const driver::PacketLayout& layout, const SyntheticSensor& sensor, int frame,
                                    int first_column) {
    std::vector<std::byte> data(layout.packet_bytes());
    driver::PacketHeader packet_header;
    packet_header.frame_id = static_cast<std::uint32_t>(frame);
    packet_header.init_id = sensor.init_id;
    packet_header.serial_number = sensor.serial_number;
    layout.write_packet_header(data, packet_header);
    for (int i = 0; i < kColumnsPerPacket; ++i) {
        const int m = first_column + i;
        const double time_s = kFramePeriod * (frame + static_cast<double>(m) / sensor.columns);
        driver::ColumnHeader header;
        header.time_ns = static_cast<std::uint64_t>(sensor.epoch_ns + static_cast<std::int64_t>(1e9 * time_s));
        header.measurement_id = static_cast<std::uint16_t>(m);
        header.frame_id = static_cast<std::uint16_t>(frame);
        header.status = layout.valid_status();
        layout.write_column_header(data, i, header);
        // The sensor's axes are the lidar's: the metadata's transform is the identity.
        const double theta = 2.0 * std::numbers::pi * (1.0 - static_cast<double>(m) / sensor.columns);
        const Eigen::Vector3d origin(sensor.speed_mps * time_s, 0.05 * std::sin(time_s), 0.0);
        for (int row = 0; row < sensor.rows; ++row) {
            const double phi = altitude_deg(sensor, row) * std::numbers::pi / 180.0;
            const Eigen::Vector3d direction(std::cos(theta) * std::cos(phi), std::sin(theta) * std::cos(phi),
                                            std::sin(phi));
            const double range = range_m(origin, direction, time_s);
            layout.write_pixel(data, i, row, driver::PixelField::kRange, static_cast<std::uint32_t>(1000.0 * range));
            layout.write_pixel(data, i, row, driver::PixelField::kReflectivity, 40);
        }
    }
    return data;
}

}  // namespace

SyntheticCapture::SyntheticCapture(int frames, const SyntheticSensor& sensor) : sensor_(sensor) {
    const driver::PacketLayout layout(*driver::find_packet_format(sensor.profile), sensor.rows, kColumnsPerPacket);
    for (int frame = sensor.first_frame; frame < sensor.first_frame + frames; ++frame) {
        for (int m = 0; m < sensor.columns; m += kColumnsPerPacket) {
            const double time_s =
                kFramePeriod * (frame + static_cast<double>(m + kColumnsPerPacket - 1) / sensor.columns);
            packets_.push_back({lidar_packet(layout, sensor, frame, m),
                                sensor.epoch_ns + static_cast<std::int64_t>(1e9 * time_s), sensor.lidar_port});
        }
    }
    for (int i = 10 * sensor.first_frame; i < 10 * (sensor.first_frame + frames); ++i) {
        const double time_s = 0.01 * i;
        ImuSample sample;
        sample.stamp_ns = sensor.epoch_ns + static_cast<std::int64_t>(1e9 * time_s);
        sample.acceleration_mps2 = Eigen::Vector3f(0.0F, static_cast<float>(-0.05 * std::sin(time_s)), 9.80665F);
        std::vector<std::byte> data(driver::kLegacyImuPacketBytes);
        driver::encode_imu_packet(data, sample, sample.stamp_ns);
        packets_.push_back({std::move(data), sample.stamp_ns, sensor.imu_port});
    }
    std::stable_sort(packets_.begin(), packets_.end(),
                     [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
}

std::string SyntheticCapture::metadata(const SyntheticSensor& sensor) {
    std::vector<double> altitude(static_cast<std::size_t>(sensor.rows));
    for (int row = 0; row < sensor.rows; ++row) altitude[static_cast<std::size_t>(row)] = altitude_deg(sensor, row);
    const std::vector<double> identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const nlohmann::json json = {{"beam_altitude_angles", altitude},
                                 {"beam_azimuth_angles", std::vector<double>(altitude.size(), 0.0)},
                                 {"data_format",
                                  {{"column_window", {0, sensor.columns - 1}},
                                   {"columns_per_frame", sensor.columns},
                                   {"columns_per_packet", kColumnsPerPacket},
                                   {"pixel_shift_by_row", std::vector<int>(altitude.size(), 0)},
                                   {"pixels_per_column", sensor.rows},
                                   {"udp_profile_imu", "LEGACY"},
                                   {"udp_profile_lidar", sensor.profile}}},
                                 {"build_rev", sensor.firmware},
                                 {"imu_to_sensor_transform", identity},
                                 {"initialization_id", sensor.init_id},
                                 {"lidar_mode", std::to_string(sensor.columns) + "x10"},
                                 {"lidar_origin_to_beam_origin_mm", 0.0},
                                 {"lidar_to_sensor_transform", identity},
                                 {"prod_line", "OS-0-" + std::to_string(sensor.rows)},
                                 {"prod_sn", std::to_string(sensor.serial_number)},
                                 {"status", sensor.status},
                                 {"udp_port_imu", sensor.imu_port},
                                 {"udp_port_lidar", sensor.lidar_port}};
    return json.dump(1);
}

std::filesystem::path SyntheticCapture::write(const std::filesystem::path& folder) const {
    const auto capture = folder / "drive.pcap";
    driver::PcapWriter writer(capture);
    for (const auto& packet : packets_) {
        driver::Packet datagram;
        datagram.data = packet.data;
        datagram.receive_ns = packet.time_ns;
        datagram.sender_address = driver::ipv4_address(10, 0, 0, 2);
        datagram.sender_port = packet.port;
        datagram.destination_port = packet.port;
        if (!writer.write(datagram)) throw std::runtime_error(writer.error());
    }
    if (!writer.flush()) throw std::runtime_error(writer.error());
    std::ofstream(folder / "drive.json") << metadata(sensor_);
    return capture;
}

TemporaryFolder::TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "dlod-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create " + name);
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace dlod::test
