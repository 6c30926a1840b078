#include "tests/driver/synthetic_sensor.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

namespace dlod::driver::test {

std::string synthetic_metadata(const SyntheticSetup& setup) {
    std::vector<double> altitude;
    std::vector<double> azimuth;
    std::vector<int> shift;
    for (int row = 0; row < setup.rows; ++row) {
        altitude.push_back(22.5 - 45.0 * row / setup.rows);
        azimuth.push_back(4.2 - 2.8 * (row % 4));
        shift.push_back(setup.columns / 85 - setup.columns / 128 * (row % 4));  // some of them negative
    }
    const int last = setup.window_last < 0 ? setup.columns - 1 : setup.window_last;
    const nlohmann::json json{
        {"beam_intrinsics",
         {{"beam_altitude_angles", altitude},
          {"beam_azimuth_angles", azimuth},
          {"lidar_origin_to_beam_origin_mm", 15.806}}},
        {"calibration_status", {{"reflectivity", {{"valid", true}}}}},
        {"config_params",
         {{"lidar_mode", std::to_string(setup.columns) + "x" + std::to_string(setup.frame_rate_hz)},
          {"timestamp_mode", "TIME_FROM_INTERNAL_OSC"},
          {"udp_port_lidar", 7502},
          {"udp_port_imu", 7503}}},
        {"imu_intrinsics",
         {{"imu_to_sensor_transform", {1, 0, 0, 6.253, 0, 1, 0, -11.775, 0, 0, 1, 7.645, 0, 0, 0, 1}}}},
        {"lidar_intrinsics", {{"lidar_to_sensor_transform", {-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1}}}},
        {"lidar_data_format",
         {{"columns_per_frame", setup.columns},
          {"columns_per_packet", setup.columns_per_packet},
          {"pixels_per_column", setup.rows},
          {"pixel_shift_by_row", shift},
          {"column_window", {setup.window_first, last}},
          {"udp_profile_lidar", setup.profile},
          {"udp_profile_imu", "LEGACY"}}},
        {"sensor_info",
         {{"prod_line", "OS-1-" + std::to_string(setup.rows)},
          {"prod_sn", setup.serial_number},
          {"build_rev", "v2.5.0"},
          {"initialization_id", 0x123456}}}};
    return json.dump(1);
}

SyntheticSensor::SyntheticSensor(const SyntheticSetup& setup)
    : info_(parse_metadata(synthetic_metadata(setup), "synthetic.json")), layout_(info_.layout()) {}

std::uint32_t SyntheticSensor::value(std::uint32_t frame_id, int row, int measurement, PixelField field) const {
    std::uint32_t h = frame_id * 2654435761U + static_cast<std::uint32_t>(row) * 40503U +
                      static_cast<std::uint32_t>(measurement) * 2246822519U + static_cast<std::uint32_t>(field) * 97U;
    h ^= h >> 15U;
    h *= 2246822519U;
    h ^= h >> 13U;
    const BitField& layout = info_.format->field(field);
    return (h & ((std::uint32_t{1} << layout.bits) - 1)) << layout.shift;
}

std::int64_t SyntheticSensor::time_ns(std::uint32_t frame_id, int measurement) const {
    const std::int64_t turn_ns = 1'000'000'000 / info_.frame_rate_hz;
    return epoch_ns + turn_ns * frame_id + turn_ns * measurement / info_.model.width;
}

std::vector<std::byte> SyntheticSensor::packet(std::uint32_t frame_id, int index) const {
    std::vector<std::byte> bytes(layout_.packet_bytes());
    const bool narrow = info_.format->frame_id_bits() == 16;
    const std::uint32_t sent_id = narrow ? frame_id & 0xFFFFU : frame_id;
    layout_.write_packet_header(
        bytes, {.frame_id = sent_id, .init_id = init_id, .serial_number = serial_number, .alert_flags = 0});
    for (int i = 0; i < layout_.columns(); ++i) {
        const int m = index * layout_.columns() + i;
        layout_.write_column_header(bytes, i,
                                    {.time_ns = static_cast<std::uint64_t>(time_ns(frame_id, m)),
                                     .measurement_id = static_cast<std::uint16_t>(m),
                                     .frame_id = static_cast<std::uint16_t>(sent_id),
                                     .encoder_count = static_cast<std::uint32_t>(m) * 88U,
                                     .status = layout_.valid_status()});
        for (int row = 0; row < layout_.rows(); ++row) {
            for (std::size_t f = 0; f < kPixelFieldCount; ++f) {
                const auto field = static_cast<PixelField>(f);
                if (info_.format->field(field).present()) {
                    layout_.write_pixel(bytes, i, row, field, value(sent_id, row, m, field));
                }
            }
        }
    }
    return bytes;
}

void SyntheticSensor::set_column(std::vector<std::byte>& packet, int column, const ColumnHeader& header) const {
    layout_.write_column_header(packet, column, header);
}

ColumnHeader SyntheticSensor::column(const std::vector<std::byte>& packet, int column) const {
    return layout_.read_column_header(packet, column);
}

BuilderBench::BuilderBench(const SyntheticSensor& sensor, FrameBuilderConfig config, int frames)
    : port(sensor.info().lidar_port),
      sensor_(sensor),
      builder(
          sensor.info(), config,
          [this]() -> Frame* {
              if (free_frames.empty()) return nullptr;
              Frame* frame = free_frames.back();
              free_frames.pop_back();
              frame->raw.range_mm.fill(0xABABABAB);
              frame->raw.reflectivity.fill(0xAB);
              frame->raw.near_ir.fill(0xABAB);
              if (sensor_.info().format->field(PixelField::kSignal).present()) frame->raw.signal.fill(0xABAB);
              std::fill(frame->columns.time_ns.begin(), frame->columns.time_ns.end(), -77);
              std::fill(frame->columns.valid.begin(), frame->columns.valid.end(), std::uint8_t{1});
              return frame;
          },
          [this](Frame* frame) {
              emitted.push_back({frame->header, frame->raw, frame->columns, frame->imu});
              free_frames.push_back(frame);
          }) {
    for (int i = 0; i < frames; ++i) {
        pool_.push_back(std::make_unique<Frame>(sensor.info().model));
        free_frames.push_back(pool_.back().get());
    }
}

void BuilderBench::push(const std::vector<std::byte>& data) {
    builder.push({.data = data,
                  .receive_ns = ++receive_ns,
                  .sender_address = sender,
                  .sender_port = 7502,
                  .destination_port = port});
}

void BuilderBench::push_frame(std::uint32_t frame_id, int first, int last) {
    for (int i = first; i < (last < 0 ? sensor_.packets_per_frame() : last); ++i) push(sensor_.packet(frame_id, i));
}

int BuilderBench::wrong_pixels(const EmittedFrame& frame) const {
    const SensorModel& model = sensor_.info().model;
    const PacketFormat& format = *sensor_.info().format;
    int wrong = 0;
    for (int row = 0; row < model.height; ++row) {
        for (int c = 0; c < model.width; ++c) {
            const int m = model.measurement_of(row, c);
            const bool valid = frame.columns.valid[static_cast<std::size_t>(m)] != 0;
            const auto sent = [&](PixelField field) {
                if (!valid || !format.field(field).present()) return std::uint32_t{0};
                return sensor_.value(frame.header.frame_id, row, m, field);
            };
            const bool right = frame.raw.range_mm(row, c) == sent(PixelField::kRange) &&
                               frame.raw.reflectivity(row, c) == sent(PixelField::kReflectivity) &&
                               frame.raw.signal(row, c) == sent(PixelField::kSignal) &&
                               frame.raw.near_ir(row, c) == sent(PixelField::kNearIr);
            wrong += right ? 0 : 1;
        }
    }
    return wrong;
}

std::uint64_t BuilderBench::faults() const {
    const std::set<std::string_view> good{"packets", "lidar_packets", "imu_packets", "frames"};
    std::uint64_t sum = 0;
    counters().visit([&](std::string_view name, std::uint64_t value) { sum += good.contains(name) ? 0 : value; });
    return sum;
}

}  // namespace dlod::driver::test
