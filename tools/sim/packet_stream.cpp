#include "tools/sim/packet_stream.hpp"

#include <algorithm>
#include <cmath>

#include "driver/imu.hpp"

namespace dlod::tools::sim {
namespace {

constexpr std::uint64_t kFaultStream = 0xFA17;
constexpr double kLidarDelay_s = 0.00025;  ///< from the last column's firing to the packet's arrival
constexpr double kImuDelay_s = 0.0011;
constexpr double kWrongScale = 1.5;
constexpr std::uint32_t kTicksATurn = 90112;  ///< of LEGACY's encoder

std::int64_t to_ns(double seconds) {
    return std::llround(seconds * 1e9);
}

enum CorruptionKind { kCutShort, kGarbage, kStranger, kInvalid, kCorruptionKinds };

/// Sets a missing turn's columns to nothing, as the truth has it.
void clear_column(const SensorModel& model, int measurement, Scan& scan) {
    for (int row = 0; row < model.height; ++row) {
        const int W = model.width;
        const int column = ((measurement + model.pixel_shift[static_cast<std::size_t>(row)]) % W + W) % W;
        scan.first.range_mm(row, column) = 0;
        scan.label(row, column) = 0;
        scan.instance(row, column) = 0;
    }
}

}  // namespace

PacketStream::PacketStream(const driver::SensorInfo& sensor, const ImuSimulator& imu, double duration_s,
                           std::uint64_t seed, const FaultOptions& faults)
    : sensor_(sensor),
      layout_(sensor.layout()),
      imu_(imu),
      duration_s_(duration_s),
      seed_(seed),
      faults_(faults),
      first_frame_id_(static_cast<std::uint32_t>(1000 + seed % 1000)) {}

void PacketStream::push(Scan& scan) {
    const SensorModel& model = sensor_.model;
    const int W = model.width;
    const int C = sensor_.columns_per_packet;
    const double turn_s = model.frame_period_s;
    const double column_s = turn_s / W;
    records_.clear();
    now_s_ = scan.start_s + turn_s;
    push_imu(now_s_);

    const auto in_window = [&](int m) {
        return (m - model.column_window_first + W) % W <=
               (model.column_window_last - model.column_window_first + W) % W;
    };
    for (int packet = 0; packet * C < W; ++packet) {
        const int first = packet * C;
        bool sent = false;
        for (int m = first; m < std::min(first + C, W); ++m) sent = sent || in_window(m);
        if (!sent) continue;
        const double fired_s = scan.start_s + column_s * first;
        const int restarts = restarts_before(faults_, fired_s);
        // A restarted sensor counts its turns from 0 again.
        std::uint32_t frame_id = first_frame_id_ + static_cast<std::uint32_t>(scan.index);
        std::uint32_t init_id = sensor_.init_id;
        if (restarts > 0) {
            const double began_s =
                faults_.restarts_s[static_cast<std::size_t>(restarts - 1)] + FaultOptions::kRestart_s;
            frame_id = static_cast<std::uint32_t>(scan.index - static_cast<int>(began_s / turn_s));
            init_id = static_cast<std::uint32_t>(mix_bits(init_id + static_cast<std::uint64_t>(restarts)) & 0xFFFFFF);
        }
        Random random(seed_, kFaultStream,
                      static_cast<std::uint64_t>(scan.index) * 4096U + static_cast<std::uint64_t>(packet));
        PacketFault fault = draw_fault(faults_, random);
        if (is_silent(faults_, fired_s)) fault = PacketFault::kLost;
        records_.push_back({frame_id, packet, first, kEpoch_ns + to_ns(fired_s), fault});

        const bool arrives = fault != PacketFault::kLost && fault != PacketFault::kCorrupted;
        for (int m = first; m < std::min(first + C, W); ++m) {
            if (!arrives || in_missing_sector(faults_, 360.0 * m / W)) clear_column(model, m, scan);
        }
        if (fault == PacketFault::kLost) continue;
        const int kind = random.integer(0, kCorruptionKinds - 1);
        const bool invalid = fault == PacketFault::kCorrupted && kind == kInvalid;
        std::vector<std::byte> bytes(layout_.packet_bytes());
        encode(scan, first, frame_id, init_id, invalid, bytes);
        if (fault == PacketFault::kCorrupted && !invalid) corrupt(bytes, kind, random);
        double send_s = fired_s + C * column_s + kLidarDelay_s + random.uniform(0.0, 0.00008);
        if (fault == PacketFault::kReordered) send_s += C * column_s * (random.integer(1, 3) + 0.5);
        if (fault == PacketFault::kDuplicated) add(bytes, send_s + C * column_s * random.uniform(0.2, 2.5), false);
        add(std::move(bytes), send_s, false);
    }
}

void PacketStream::encode(const Scan& scan, int first_column, std::uint32_t frame_id, std::uint32_t init_id,
                          bool invalid, std::vector<std::byte>& bytes) const {
    using driver::PixelField;
    const SensorModel& model = sensor_.model;
    const int W = model.width;
    layout_.write_packet_header(bytes, {.frame_id = frame_id, .init_id = init_id, .serial_number = sensor_.serial()});
    const driver::PacketFormat& format = layout_.format();
    const bool dual = format.field(PixelField::kRange2).present();
    for (int c = 0; c < sensor_.columns_per_packet; ++c) {
        const int m = first_column + c;
        const double fired_s = scan.start_s + model.frame_period_s * m / W;
        const double shown_s = fired_s + clock_offset_s(faults_, fired_s);
        const bool valid = !invalid && m < W && !in_missing_sector(faults_, 360.0 * m / W);
        layout_.write_column_header(
            bytes, c,
            {.time_ns = static_cast<std::uint64_t>(kEpoch_ns + to_ns(shown_s)),
             .measurement_id = static_cast<std::uint16_t>(m),
             .frame_id = static_cast<std::uint16_t>(frame_id),
             .encoder_count = kTicksATurn * static_cast<std::uint32_t>(m) / static_cast<std::uint32_t>(W),
             .status = valid ? layout_.valid_status() : 0U});
        if (!valid) continue;
        for (int row = 0; row < model.height; ++row) {
            const int column = ((m + model.pixel_shift[static_cast<std::size_t>(row)]) % W + W) % W;
            const auto write = [&](PixelField field, std::uint32_t value) {
                if (format.field(field).present()) layout_.write_pixel(bytes, c, row, field, value);
            };
            write(PixelField::kRange, scan.first.range_mm(row, column));
            write(PixelField::kReflectivity, scan.first.reflectivity(row, column));
            write(PixelField::kSignal, scan.first.signal(row, column));
            write(PixelField::kNearIr, scan.near_ir(row, column));
            if (!dual) continue;
            write(PixelField::kRange2, scan.second.range_mm(row, column));
            write(PixelField::kReflectivity2, scan.second.reflectivity(row, column));
            write(PixelField::kSignal2, scan.second.signal(row, column));
        }
    }
}

void PacketStream::corrupt(std::vector<std::byte>& bytes, int kind, Random& random) const {
    const driver::PacketFormat& format = layout_.format();
    if (kind == kStranger && format.serial_number.present()) {
        driver::PacketHeader header = layout_.read_packet_header(bytes);
        header.serial_number += 1 + random.bits() % 1000;
        layout_.write_packet_header(bytes, header);
    } else if (kind == kGarbage) {
        for (std::byte& b : bytes) b = static_cast<std::byte>(random.bits());
        // Not by chance the type of a lidar packet.
        if (format.packet_type.present()) format.packet_type.write(bytes.data(), 0xBAD);
    } else {
        bytes.resize(static_cast<std::size_t>(random.integer(1, static_cast<int>(bytes.size()) - 1)));
    }
}

void PacketStream::push_imu(double until_s) {
    for (; ImuSimulator::time_s(next_imu_) < until_s; ++next_imu_) {
        const double t = ImuSimulator::time_s(next_imu_);
        if (is_silent(faults_, t)) continue;
        const ImuFault fault = imu_is_faulty(faults_, t, duration_s_) ? faults_.imu : ImuFault::kNone;
        if (fault == ImuFault::kOff || fault == ImuFault::kSilent) continue;
        ImuReading reading = imu_.measured(next_imu_);
        Random random(seed_, kFaultStream + 1, static_cast<std::uint64_t>(next_imu_));
        if (fault == ImuFault::kStuck) {
            const double from_s = faults_.imu_fault_s ? faults_.imu_fault_s->first : 0.3 * duration_s_;
            reading = imu_.measured(static_cast<int>(from_s / ImuSimulator::kPeriod_s));
        } else if (fault == ImuFault::kSpikes && random.chance(0.03)) {
            reading.acceleration_mps2 += Vec3(random.normal(), random.normal(), random.normal()) * 100.0;
            reading.angular_velocity_radps += Vec3(random.normal(), random.normal(), random.normal()) * 15.0;
        } else if (fault == ImuFault::kScale) {
            reading.acceleration_mps2 *= kWrongScale;
            reading.angular_velocity_radps *= kWrongScale;
        } else if (fault == ImuFault::kAxes) {
            for (Vec3* v : {&reading.acceleration_mps2, &reading.angular_velocity_radps}) {
                *v = Vec3(v->z(), -v->x(), v->y());
            }
        }
        const ImuSample sample{.stamp_ns = kEpoch_ns + to_ns(t + clock_offset_s(faults_, t)),
                               .acceleration_mps2 = reading.acceleration_mps2.cast<float>(),
                               .angular_velocity_radps = reading.angular_velocity_radps.cast<float>()};
        std::vector<std::byte> bytes(driver::kLegacyImuPacketBytes);
        driver::encode_imu_packet(bytes, sample, sample.stamp_ns + 200'000);
        add(std::move(bytes), t + kImuDelay_s, true);
    }
}

void PacketStream::add(std::vector<std::byte> bytes, double send_s, bool imu) {
    pending_.push_back({std::move(bytes), kEpoch_ns + to_ns(send_s), imu});
}

std::vector<Datagram> PacketStream::take(bool all) {
    std::stable_sort(pending_.begin(), pending_.end(),
                     [](const Datagram& a, const Datagram& b) { return a.send_ns < b.send_ns; });
    const std::int64_t due_ns = kEpoch_ns + to_ns(now_s_);
    const auto end =
        all ? pending_.end()
            : std::find_if(pending_.begin(), pending_.end(), [&](const Datagram& d) { return d.send_ns >= due_ns; });
    std::vector<Datagram> due(std::make_move_iterator(pending_.begin()), std::make_move_iterator(end));
    pending_.erase(pending_.begin(), end);
    return due;
}

}  // namespace dlod::tools::sim
