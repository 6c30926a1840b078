// The sensor's metadata file (JSON, as from its HTTP API): what is needed to decode its packets and to place their
// points.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/types/sensor_model.hpp"
#include "driver/packet_format.hpp"

namespace dlod::driver {

/// The metadata cannot be used; the message names the file, the key and what is wrong with it.
class MetadataError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

struct SensorInfo {
    SensorModel model;
    std::string product_line;      ///< such as OS-0-128
    std::string serial_number;     ///< decimal, empty where the file does not say
    std::string firmware;          ///< such as v2.3.0
    std::string lidar_mode;        ///< such as 1024x10
    std::string profile_name;      ///< udp_profile_lidar
    std::string imu_profile_name;  ///< udp_profile_imu
    std::string timestamp_mode;    ///< such as TIME_FROM_PTP_1588, empty where the file does not say
    std::uint32_t init_id = 0;  ///< of the sensor's start that the file was read in; packets may come from a later one
    int columns_per_packet = 16;
    int frame_rate_hz = 10;
    std::uint16_t lidar_port = 7502;
    std::uint16_t imu_port = 7503;
    const PacketFormat* format = nullptr;  ///< never null in what parse_metadata returns
    std::vector<std::string> warnings;     ///< what was missing and replaced, or is odd and harmless

    PacketLayout layout() const { return {*format, model.height, columns_per_packet}; }
    /// Product line, serial number, firmware, mode and packet profile, for people; without what is not known.
    std::string description() const;
    /// Number in serial_number, 0 where it is empty or not a number: packets are then not told apart by it.
    std::uint64_t serial() const;
};

/// Reads flat (firmware 1.x, 2.x) and nested metadata. Fields that geometry, decoding or ports need must be there and
/// agree with each other. What firmware or reduced files are known to leave out is replaced, with a warning:
/// - udp_profile_lidar: LEGACY (no warning, this is how old firmware says so)
/// - the whole data_format of firmware 1.x (64 rows): 16 columns a packet, pixel shifts 18, 12, 6, 0 at 1024 columns
/// - lidar_origin_to_beam_origin_mm: OS-0 27.67, OS-1 15.806 (12.163 with firmware 1.x), OS-2 13.762
/// - lidar_to_sensor_transform: half a turn about z, raised by 36.18 mm (OS-2: 74.296 mm)
/// - imu_to_sensor_transform: no turn, at 6.253, -11.775, 7.645 mm
/// - ports: 7502 (lidar), 7503 (IMU)
/// @param name  what messages call the file
/// @throws MetadataError
SensorInfo parse_metadata(std::string_view json, const std::string& name);

/// A metadata file's content, which is not empty. @throws MetadataError where it cannot be read
std::string read_metadata(const std::filesystem::path& path);

/// parse_metadata of a file's content.
/// @throws MetadataError  also where the file cannot be read
SensorInfo load_metadata(const std::filesystem::path& path);

}  // namespace dlod::driver
