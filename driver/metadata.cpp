#include "driver/metadata.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "driver/printable.hpp"

namespace dlod::driver {
namespace {

using Json = nlohmann::json;

constexpr double kMetresPerMillimetre = 1e-3;
constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
constexpr int kMaximumRows = 128;
constexpr int kMaximumColumns = 4096;
constexpr int kMaximumFrameRate_hz = 100;
constexpr std::size_t kMaximumUdpPayload = 65507;
constexpr int kDefaultColumnsPerPacket = 16;
// Firmware rounds what it writes; beyond this two statements of the same length contradict each other.
constexpr double kLengthTolerance_mm = 0.01;
constexpr double kRotationTolerance = 1e-3;
constexpr double kMaximumOffset_mm = 1000.0;

/// Access to keys by their path, whichever layout the file has, with messages that name file and path.
class Reader {
  public:
    Reader(const Json& root, const std::string& name, std::vector<std::string>& warnings)
        : root_(root), name_(name), warnings_(warnings) {
        for (const char* section : {"beam_intrinsics", "lidar_data_format", "config_params", "sensor_info"}) {
            nested_ = nested_ || root_.contains(section);
        }
    }

    bool nested() const { return nested_; }

    /// Where the file has, or should have, what nested metadata calls section.key.
    std::string path(std::string_view section, std::string_view key) const {
        std::string path;
        if (nested_) {
            path = section;
        } else if (section == "lidar_data_format") {
            path = "data_format";
        }
        if (!path.empty()) path += '.';
        return path.append(key);
    }

    const Json* find(std::string_view section, std::string_view key) const {
        const Json* object = &root_;
        if (nested_) {
            object = find_in(root_, section);
        } else if (section == "lidar_data_format") {
            object = find_in(root_, "data_format");
        }
        return object == nullptr ? nullptr : find_in(*object, key);
    }

    const Json& require(std::string_view section, std::string_view key) const {
        const Json* value = find(section, key);
        if (value == nullptr) fail(path(section, key), "is missing");
        return *value;
    }

    int integer(std::string_view section, std::string_view key, int low, int high) const {
        return to_integer(require(section, key), path(section, key), low, high);
    }

    std::optional<int> optional_integer(std::string_view section, std::string_view key, int low, int high) const {
        const Json* value = find(section, key);
        if (value == nullptr) return std::nullopt;
        return to_integer(*value, path(section, key), low, high);
    }

    std::string text(std::string_view section, std::string_view key) const {
        const Json* value = find(section, key);
        if (value == nullptr) return {};
        if (value->is_number_unsigned()) return std::to_string(value->get<std::uint64_t>());
        if (!value->is_string()) fail(path(section, key), "must be a text");
        return printable(value->get_ref<const std::string&>());
    }

    std::vector<double> numbers(std::string_view section, std::string_view key, double limit) const {
        const Json& array = require(section, key);
        if (!array.is_array()) fail(path(section, key), "must be an array of numbers");
        std::vector<double> values;
        for (const Json& element : array) {
            if (!element.is_number() || !(std::abs(element.get<double>()) <= limit)) {
                fail(path(section, key) + "[" + std::to_string(values.size()) + "]",
                     "must be a number of at most " + std::to_string(static_cast<int>(limit)) + " in amount");
            }
            values.push_back(element.get<double>());
        }
        return values;
    }

    /// A rigid transform given row-major in millimetres, as metres; nothing where the key is not there.
    std::optional<Eigen::Isometry3d> transform(std::string_view section, std::string_view key) const {
        if (find(section, key) == nullptr) return std::nullopt;
        const std::vector<double> values = numbers(section, key, kMaximumOffset_mm);
        if (values.size() != 16) fail(path(section, key), "must have 16 numbers, has " + std::to_string(values.size()));
        Eigen::Matrix4d m = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
        const Eigen::Matrix3d rotation = m.topLeftCorner<3, 3>();
        const bool rigid =
            (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < kRotationTolerance &&
            rotation.determinant() > 0.0 && m.row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0);
        if (!rigid) fail(path(section, key), "is no rigid transform");
        Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
        T.linear() = rotation;
        T.translation() = m.topRightCorner<3, 1>() * kMetresPerMillimetre;
        return T;
    }

    void warn(const std::string& path, const std::string& what) const {
        warnings_.push_back(name_ + ": " + path + ": " + what);
    }

    [[noreturn]] void fail(const std::string& path, const std::string& what) const {
        throw MetadataError(name_ + ": " + path + ": " + what);
    }

  private:
    static const Json* find_in(const Json& object, std::string_view key) {
        if (!object.is_object()) return nullptr;
        const auto found = object.find(key);
        return found == object.end() || found->is_null() ? nullptr : &*found;
    }

    int to_integer(const Json& value, const std::string& at, int low, int high) const {
        const double number = value.is_number() ? value.get<double>() : std::nan("");
        if (!(number >= low && number <= high) || number != std::floor(number)) {
            fail(at, "must be an integer from " + std::to_string(low) + " to " + std::to_string(high));
        }
        return static_cast<int>(number);
    }

    const Json& root_;
    const std::string& name_;
    std::vector<std::string>& warnings_;
    bool nested_ = false;
};

/// What reduced files leave out, by product line.
struct ProductDefaults {
    double beam_origin_mm = 0.0;
    double lidar_height_mm = 0.0;
};

ProductDefaults product_defaults(const SensorInfo& info) {
    if (info.product_line.starts_with("OS-0")) return {27.67, 36.18};
    if (info.product_line.starts_with("OS-2")) return {13.762, 74.296};
    return {info.firmware.starts_with("v1.") ? 12.163 : 15.806, 36.18};
}

void read_identity(const Reader& reader, SensorInfo& info) {
    info.product_line = reader.text("sensor_info", "prod_line");
    info.serial_number = reader.text("sensor_info", "prod_sn");
    info.firmware = reader.text("sensor_info", "build_rev");
    info.timestamp_mode = reader.text("config_params", "timestamp_mode");
    info.init_id = static_cast<std::uint32_t>(
        reader.optional_integer("sensor_info", "initialization_id", 0, (1 << 24) - 1).value_or(0));
    if (info.serial() == 0) {
        reader.warn(reader.path("sensor_info", "prod_sn"),
                    "no serial number: packets of other sensors are told by their sender only");
    }
    if (info.product_line.empty()) {
        reader.warn(reader.path("sensor_info", "prod_line"),
                    "missing, defaults of the OS-1 are taken where any are needed");
    }
    const Json* calibration = reader.find("calibration_status", "reflectivity");
    if (reader.nested() && calibration == nullptr) {
        reader.warn("calibration_status", "missing or unreadable, reflectivity may not be calibrated");
    }
}

void read_mode(const Reader& reader, SensorInfo& info) {
    const std::string key = reader.path("config_params", "lidar_mode");
    const std::optional<int> fps = reader.optional_integer("lidar_data_format", "fps", 1, kMaximumFrameRate_hz);
    info.lidar_mode = reader.text("config_params", "lidar_mode");
    if (info.lidar_mode.empty()) {
        if (!fps || reader.find("lidar_data_format", "columns_per_frame") == nullptr) reader.fail(key, "is missing");
        info.frame_rate_hz = *fps;
        return;
    }
    const char* end = info.lidar_mode.data() + info.lidar_mode.size();
    const auto [x, columns_error] = std::from_chars(info.lidar_mode.data(), end, info.model.width);
    const bool separated = columns_error == std::errc{} && x != end && *x == 'x';
    const auto rate = separated ? std::from_chars(x + 1, end, info.frame_rate_hz)
                                : std::from_chars_result{x, std::errc::invalid_argument};
    if (rate.ec != std::errc{} || rate.ptr != end || info.model.width < 1 || info.model.width > kMaximumColumns ||
        info.frame_rate_hz < 1 || info.frame_rate_hz > kMaximumFrameRate_hz) {
        reader.fail(key, "'" + info.lidar_mode + "' is no mode such as 1024x10");
    }
    if (fps && *fps != info.frame_rate_hz) {
        reader.fail(key, info.lidar_mode + " contradicts " + reader.path("lidar_data_format", "fps") + " " +
                             std::to_string(*fps));
    }
}

void read_profiles(const Reader& reader, SensorInfo& info) {
    const std::string key = reader.path("lidar_data_format", "udp_profile_lidar");
    const std::string configured = reader.text("config_params", "udp_profile_lidar");
    info.profile_name = reader.text("lidar_data_format", "udp_profile_lidar");
    if (reader.nested() && !info.profile_name.empty() && !configured.empty() && configured != info.profile_name) {
        reader.fail(key, info.profile_name + " contradicts config_params.udp_profile_lidar " + configured);
    }
    if (info.profile_name.empty()) info.profile_name = configured.empty() ? "LEGACY" : configured;
    info.format = find_packet_format(info.profile_name);
    if (info.format == nullptr) {
        reader.fail(key, "unknown profile '" + info.profile_name + "'; known are " + known_packet_formats());
    }
    info.imu_profile_name = reader.text("lidar_data_format", "udp_profile_imu");
    if (info.imu_profile_name.empty()) info.imu_profile_name = "LEGACY";
    if (info.imu_profile_name != "LEGACY") {
        reader.warn(reader.path("lidar_data_format", "udp_profile_imu"),
                    "'" + info.imu_profile_name + "' is not decoded, the IMU is not used; LEGACY would be");
    }
}

void read_beams(const Reader& reader, SensorInfo& info) {
    const std::vector<double> altitude = reader.numbers("beam_intrinsics", "beam_altitude_angles", 90.0);
    const std::vector<double> azimuth = reader.numbers("beam_intrinsics", "beam_azimuth_angles", 180.0);
    const std::string altitude_key = reader.path("beam_intrinsics", "beam_altitude_angles");
    if (altitude.size() != azimuth.size()) {
        reader.fail(altitude_key, "has " + std::to_string(altitude.size()) + " angles, but beam_azimuth_angles has " +
                                      std::to_string(azimuth.size()));
    }
    if (altitude.empty() || altitude.size() > static_cast<std::size_t>(kMaximumRows)) {
        reader.fail(altitude_key, "must have 1 to " + std::to_string(kMaximumRows) + " angles");
    }
    // Sensors with fewer beams than rows give 0 for the missing ones, but not for all of them.
    if (altitude.size() > 1 && std::all_of(altitude.begin(), altitude.end(), [](double a) { return a == 0.0; })) {
        reader.fail(altitude_key, "all angles are 0: the sensor had not read its calibration");
    }
    SensorModel& model = info.model;
    model.height = static_cast<int>(altitude.size());
    for (std::size_t row = 0; row < altitude.size(); ++row) {
        model.altitude_rad.push_back(static_cast<float>(altitude[row] * kRadiansPerDegree));
        model.azimuth_offset_rad.push_back(static_cast<float>(azimuth[row] * kRadiansPerDegree));
    }
}

/// Firmware 1.x has no data_format: its sensors all have 64 rows, full turns, and groups of four beams side by side.
void assume_data_format(const Reader& reader, SensorInfo& info) {
    constexpr int kRows = 64;
    constexpr int kBeamsSideBySide = 4;
    constexpr int kShiftAt1024Columns = 6;
    SensorModel& model = info.model;
    if (model.height != kRows)
        reader.fail("data_format", "is missing, and can only be assumed for sensors with 64 rows");
    reader.warn("data_format", "missing, that of firmware 1.x is assumed");
    info.columns_per_packet = kDefaultColumnsPerPacket;
    model.column_window_first = 0;
    model.column_window_last = model.width - 1;
    for (int row = 0; row < model.height; ++row) {
        const int beam = kBeamsSideBySide - 1 - row % kBeamsSideBySide;
        model.pixel_shift.push_back(beam * kShiftAt1024Columns * model.width / 1024);
    }
}

void read_data_format(const Reader& reader, SensorInfo& info) {
    constexpr std::string_view kSection = "lidar_data_format";
    SensorModel& model = info.model;
    const int columns = reader.integer(kSection, "columns_per_frame", 1, kMaximumColumns);
    if (model.width != 0 && columns != model.width) {
        reader.fail(reader.path(kSection, "columns_per_frame"),
                    std::to_string(columns) + " contradicts lidar_mode " + info.lidar_mode);
    }
    model.width = columns;
    const int rows = reader.integer(kSection, "pixels_per_column", 1, kMaximumRows);
    if (rows != model.height) {
        reader.fail(reader.path(kSection, "pixels_per_column"),
                    std::to_string(rows) + " contradicts the " + std::to_string(model.height) + " beam angles");
    }
    info.columns_per_packet = reader.integer(kSection, "columns_per_packet", 1, columns);
    const std::optional<int> configured = reader.optional_integer("config_params", "columns_per_packet", 1, columns);
    if (configured && *configured != info.columns_per_packet) {
        reader.fail(reader.path(kSection, "columns_per_packet"),
                    std::to_string(info.columns_per_packet) + " contradicts " +
                        reader.path("config_params", "columns_per_packet") + " " + std::to_string(*configured));
    }
    const std::vector<double> shifts = reader.numbers(kSection, "pixel_shift_by_row", columns);
    if (shifts.size() != static_cast<std::size_t>(rows)) {
        reader.fail(
            reader.path(kSection, "pixel_shift_by_row"),
            "has " + std::to_string(shifts.size()) + " numbers, not " + std::to_string(rows) + " as there are rows");
    }
    for (const double shift : shifts) {
        if (shift != std::floor(shift)) reader.fail(reader.path(kSection, "pixel_shift_by_row"), "must be integers");
        model.pixel_shift.push_back(static_cast<int>(shift));
    }
    model.column_window_first = 0;
    model.column_window_last = columns - 1;
    const std::string window_key = reader.path(kSection, "column_window");
    if (reader.find(kSection, "column_window") == nullptr) {
        reader.warn(window_key, "missing, full turns are assumed");
        return;
    }
    const std::vector<double> window = reader.numbers(kSection, "column_window", columns - 1);
    const bool good = window.size() == 2 && std::all_of(window.begin(), window.end(),
                                                        [](double c) { return c >= 0.0 && c == std::floor(c); });
    if (!good) reader.fail(window_key, "must be two columns from 0 to " + std::to_string(columns - 1));
    model.column_window_first = static_cast<int>(window[0]);
    model.column_window_last = static_cast<int>(window[1]);
}

void read_beam_origin(const Reader& reader, SensorInfo& info) {
    const std::string length_key = reader.path("beam_intrinsics", "lidar_origin_to_beam_origin_mm");
    const std::string transform_key = reader.path("beam_intrinsics", "beam_to_lidar_transform");
    std::optional<double> length_mm;
    if (const Json* length = reader.find("beam_intrinsics", "lidar_origin_to_beam_origin_mm")) {
        if (!length->is_number() || !(std::abs(length->get<double>()) <= kMaximumOffset_mm)) {
            reader.fail(length_key, "must be a number of millimetres");
        }
        length_mm = length->get<double>();
    }
    if (const auto T_lidar_beam = reader.transform("beam_intrinsics", "beam_to_lidar_transform")) {
        const Eigen::Vector3d origin_mm = T_lidar_beam->translation() / kMetresPerMillimetre;
        if (!T_lidar_beam->linear().isIdentity(kRotationTolerance) || std::abs(origin_mm.y()) > kLengthTolerance_mm) {
            reader.fail(transform_key, "only beam origins off the axis along x and z are supported");
        }
        const auto contradicts = [&](double mm) { return std::abs(mm - *length_mm) > kLengthTolerance_mm; };
        if (length_mm && contradicts(origin_mm.x()) && contradicts(origin_mm.norm())) {
            reader.fail(length_key, "contradicts " + transform_key);
        }
        info.model.beam_origin_m = static_cast<float>(T_lidar_beam->translation().x());
        info.model.beam_origin_height_m = static_cast<float>(T_lidar_beam->translation().z());
        return;
    }
    if (!length_mm) {
        length_mm = product_defaults(info).beam_origin_mm;
        reader.warn(length_key, "missing, " + std::to_string(*length_mm) + " mm is assumed");
    }
    info.model.beam_origin_m = static_cast<float>(*length_mm * kMetresPerMillimetre);
}

void read_transforms(const Reader& reader, SensorInfo& info) {
    if (const auto T = reader.transform("lidar_intrinsics", "lidar_to_sensor_transform")) {
        info.model.T_sensor_lidar = *T;
    } else {
        const double height_mm = product_defaults(info).lidar_height_mm;
        info.model.T_sensor_lidar.linear() = Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
        info.model.T_sensor_lidar.translation() = Eigen::Vector3d(0.0, 0.0, height_mm * kMetresPerMillimetre);
        reader.warn(reader.path("lidar_intrinsics", "lidar_to_sensor_transform"),
                    "missing, half a turn about z and " + std::to_string(height_mm) + " mm up is assumed");
    }
    if (const auto T = reader.transform("imu_intrinsics", "imu_to_sensor_transform")) {
        info.model.T_sensor_imu = *T;
    } else {
        info.model.T_sensor_imu.translation() = Eigen::Vector3d(6.253, -11.775, 7.645) * kMetresPerMillimetre;
        reader.warn(reader.path("imu_intrinsics", "imu_to_sensor_transform"),
                    "missing, 6.253 -11.775 7.645 mm is assumed");
    }
}

void read_ports(const Reader& reader, SensorInfo& info) {
    const auto port = [&](std::string_view key, std::uint16_t assumed) {
        const std::optional<int> value = reader.optional_integer("config_params", key, 1, 65535);
        if (!value)
            reader.warn(reader.path("config_params", key), "missing, " + std::to_string(assumed) + " is assumed");
        return static_cast<std::uint16_t>(value.value_or(assumed));
    };
    info.lidar_port = port("udp_port_lidar", info.lidar_port);
    info.imu_port = port("udp_port_imu", info.imu_port);
}

}  // namespace

std::string SensorInfo::description() const {
    std::string text = product_line.empty() ? "sensor of an unknown product line" : product_line;
    for (const std::string* part : {&serial_number, &firmware, &lidar_mode, &profile_name}) {
        if (!part->empty()) text += ' ' + *part;
    }
    return text;
}

std::uint64_t SensorInfo::serial() const {
    std::uint64_t number = 0;
    const char* end = serial_number.data() + serial_number.size();
    const auto result = std::from_chars(serial_number.data(), end, number);
    return result.ec == std::errc{} && result.ptr == end ? number : 0;
}

SensorInfo parse_metadata(std::string_view json, const std::string& name) {
    Json root;
    try {
        root = Json::parse(json);
    } catch (const Json::exception& error) {
        throw MetadataError(name + ": not a JSON file: " + printable(error.what(), 300));
    }
    if (!root.is_object()) throw MetadataError(name + ": the outermost value must be an object");
    SensorInfo info;
    const Reader reader(root, name, info.warnings);
    read_identity(reader, info);
    read_mode(reader, info);
    read_profiles(reader, info);
    read_beams(reader, info);
    if (!reader.nested() && !root.contains("data_format")) {
        assume_data_format(reader, info);
    } else {
        read_data_format(reader, info);
    }
    info.model.frame_period_s = 1.0 / info.frame_rate_hz;
    read_beam_origin(reader, info);
    read_transforms(reader, info);
    read_ports(reader, info);
    if (info.layout().packet_bytes() > kMaximumUdpPayload) {
        reader.fail(reader.path("lidar_data_format", "columns_per_packet"),
                    "packets would be larger than a UDP datagram");
    }
    return info;
}

std::string read_metadata(const std::filesystem::path& path) {
    if (std::filesystem::is_directory(path)) {
        throw MetadataError(path.string() + ": is a folder, not the sensor's metadata file");
    }
    std::ifstream file(path, std::ios::binary);
    if (!file) throw MetadataError(path.string() + ": cannot be read: " + std::strerror(errno));
    std::string content{std::istreambuf_iterator<char>(file), {}};
    if (content.empty()) throw MetadataError(path.string() + ": is empty");
    return content;
}

SensorInfo load_metadata(const std::filesystem::path& path) {
    return parse_metadata(read_metadata(path), path.string());
}

}  // namespace dlod::driver
