#include "tools/sim/sensor_metadata.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "driver/packet_format.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {
namespace {

using Json = nlohmann::json;

constexpr int kColumns = 1024;

struct Product {
    std::string_view name;
    std::string_view line;
    double half_view_deg;
    double azimuth_deg;  ///< of the outer of four emitter columns
    double beam_origin_mm;
    double lidar_height_mm;
};

constexpr Product kProducts[] = {
    {"OS0", "OS-0", 45.3, 8.9, 27.67, 36.18},
    {"OS1", "OS-1", 21.4, 4.2, 15.806, 36.18},
    {"OS2", "OS-2", 11.1, 2.1, 13.762, 74.296},
};

double rounded(double value) {
    return std::round(value * 100.0) / 100.0;
}

/// The section that says how packets are laid out, in flat and in nested files.
Json& data_format(Json& root) {
    const char* key = root.contains("lidar_data_format") ? "lidar_data_format" : "data_format";
    if (!root.contains(key)) throw std::invalid_argument("metadata without a data format cannot be changed");
    return root[key];
}

Json& config(Json& root) {
    return root.contains("config_params") ? root["config_params"] : root;
}

std::pair<int, int> parse_mode(const std::string& mode) {
    int columns = 0;
    int rate = 0;
    const char* end = mode.data() + mode.size();
    const auto [x, error] = std::from_chars(mode.data(), end, columns);
    const bool good = error == std::errc{} && x != end && *x == 'x' && std::from_chars(x + 1, end, rate).ptr == end;
    if (!good || columns < 64 || columns > 4096 || rate < 1 || rate > 40) {
        throw std::invalid_argument("'" + mode + "' is no mode such as 1024x10");
    }
    return {columns, rate};
}

}  // namespace

std::string make_metadata(std::string_view sensor) {
    const Product* product = nullptr;
    int rows = 0;
    for (const Product& p : kProducts) {
        if (!sensor.starts_with(p.name) || sensor.size() < 5 || sensor[3] != '-') continue;
        const std::string_view number = sensor.substr(4);
        if (std::from_chars(number.data(), number.data() + number.size(), rows).ptr != number.data() + number.size()) {
            rows = 0;
        }
        product = &p;
    }
    if (product == nullptr || (rows != 16 && rows != 32 && rows != 64 && rows != 128)) {
        throw std::invalid_argument("'" + std::string(sensor) +
                                    "' is no sensor that can be made up: OS0, OS1 or OS2 with 16, 32, 64 or 128 rows, "
                                    "such as OS0-128");
    }
    // Beams evenly spread, then off by what calibration finds; four columns of emitters in turn.
    Random random(static_cast<std::uint64_t>(rows), static_cast<std::uint64_t>(product - kProducts));
    std::vector<double> altitude;
    std::vector<double> azimuth;
    std::vector<int> shift;
    const double spacing = 2.0 * product->half_view_deg / (rows - 1);
    double lowest = 0.0;
    for (int row = 0; row < rows; ++row) {
        altitude.push_back(
            rounded(product->half_view_deg - spacing * row + 0.12 * spacing * random.uniform(-1.0, 1.0)));
        const double up = std::cos(altitude.back() * 0.0174533);  // offsets widen away from the horizon
        const double column = (3.0 - 2.0 * (row % 4)) / 3.0;
        azimuth.push_back(rounded(product->azimuth_deg * column / up + random.uniform(-0.06, 0.06)));
        lowest = std::min(lowest, azimuth.back());
    }
    for (const double a : azimuth) shift.push_back(static_cast<int>(std::lround((a - lowest) * kColumns / 360.0)));

    const std::string profile = rows == 128 ? "RNG15_RFL8_NIR8" : "RNG19_RFL8_SIG16_NIR16";
    const double h = product->lidar_height_mm;
    Json root;
    root["beam_intrinsics"] = {{"beam_altitude_angles", altitude},
                               {"beam_azimuth_angles", azimuth},
                               {"lidar_origin_to_beam_origin_mm", product->beam_origin_mm}};
    root["lidar_intrinsics"] = {{"lidar_to_sensor_transform", {-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, h, 0, 0, 0, 1}}};
    root["imu_intrinsics"] = {
        {"imu_to_sensor_transform", {1, 0, 0, 6.253, 0, 1, 0, -11.775, 0, 0, 1, 7.645, 0, 0, 0, 1}}};
    root["lidar_data_format"] = {{"columns_per_frame", kColumns},      {"columns_per_packet", 16},
                                 {"column_window", {0, kColumns - 1}}, {"pixels_per_column", rows},
                                 {"pixel_shift_by_row", shift},        {"udp_profile_lidar", profile},
                                 {"udp_profile_imu", "LEGACY"},        {"fps", 10}};
    root["config_params"] = {{"lidar_mode", "1024x10"},      {"timestamp_mode", "TIME_FROM_PTP_1588"},
                             {"udp_port_lidar", 7502},       {"udp_port_imu", 7503},
                             {"udp_profile_lidar", profile}, {"udp_profile_imu", "LEGACY"},
                             {"columns_per_packet", 16}};
    root["sensor_info"] = {{"prod_line", std::string(product->line) + "-" + std::to_string(rows)},
                           {"prod_sn", "992400" + std::to_string(100000 + rows)},
                           {"build_rev", "v3.1.0"},
                           {"image_rev", "simulated"},
                           {"initialization_id", 4711 + rows},
                           {"status", "RUNNING"}};
    root["calibration_status"] = {{"reflectivity", {{"valid", true}}}};
    return root.dump(1) + "\n";
}

std::string with_profile(const std::string& metadata, const std::string& profile) {
    if (driver::find_packet_format(profile) == nullptr) {
        throw std::invalid_argument("unknown profile '" + profile + "'; known are " + driver::known_packet_formats());
    }
    Json root = Json::parse(metadata);
    data_format(root)["udp_profile_lidar"] = profile;
    if (root.contains("config_params")) root["config_params"]["udp_profile_lidar"] = profile;
    return root.dump(1) + "\n";
}

std::string with_mode(const std::string& metadata, const std::string& mode) {
    const auto [columns, rate] = parse_mode(mode);
    Json root = Json::parse(metadata);
    Json& format = data_format(root);
    const double scale = columns / format.at("columns_per_frame").get<double>();
    for (Json& shift : format.at("pixel_shift_by_row")) {
        shift = static_cast<int>(std::lround(shift.get<double>() * scale));
    }
    format["columns_per_frame"] = columns;
    format["column_window"] = {0, columns - 1};
    if (format.contains("fps")) format["fps"] = rate;
    config(root)["lidar_mode"] = mode;
    return root.dump(1) + "\n";
}

}  // namespace dlod::tools::sim
