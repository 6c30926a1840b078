#include "driver/packet_format.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace dlod::driver {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian and read in place");

// Headers and columns that all profiles but LEGACY and FUSA share.
constexpr PacketFormat kCommon{
    .packet_header_bytes = 32,
    .packet_footer_bytes = 32,
    .column_header_bytes = 12,
    .packet_type = {0, 16},
    .packet_frame_id = {16, 16},
    .init_id = {32, 24},
    .serial_number = {56, 40},
    .alert_flags = {96, 8},
    .time_ns = {0, 64},
    .measurement_id = {64, 16},
    .status = {80, 16},
    .valid_status = 1,
};

constexpr PacketFormat with_pixels(PacketFormat format, std::string_view name, int pixel_bytes,
                                   const std::array<BitField, kPixelFieldCount>& pixel) {
    format.name = name;
    format.pixel_bytes = pixel_bytes;
    format.pixel = pixel;
    return format;
}

constexpr PacketFormat fusa_header(PacketFormat format) {
    format.packet_type = {0, 8};
    format.init_id = {8, 24};
    format.packet_frame_id = {32, 32};
    format.alert_flags = {64, 8};
    format.serial_number = {88, 40};
    return format;
}

constexpr PacketFormat kLegacy{
    .name = "LEGACY",
    .column_header_bytes = 16,
    .column_footer_bytes = 4,
    .pixel_bytes = 12,
    .time_ns = {0, 64},
    .measurement_id = {64, 16},
    .column_frame_id = {80, 16},
    .encoder_count = {96, 32},
    .status = {0, 32},
    .status_in_footer = true,
    .valid_status = 0xFFFFFFFF,
    .pixel = {{{0, 20}, {32, 8}, {48, 16}, {64, 16}, {28, 4}, {}, {}, {}, {}}},
};

// Pixel fields in the order of PixelField: range, reflectivity, signal, near IR, flags, then the second return's range,
// reflectivity, signal, flags.
constexpr std::array<BitField, kPixelFieldCount> kRng15Dual{
    {{0, 15, 3}, {16, 8}, {}, {24, 8, 4}, {15, 1}, {32, 15, 3}, {48, 8}, {}, {47, 1}}};

constexpr std::array<PacketFormat, 6> kFormats{
    kLegacy,
    with_pixels(kCommon, "RNG19_RFL8_SIG16_NIR16", 12,
                {{{0, 19}, {32, 8}, {48, 16}, {64, 16}, {19, 5}, {}, {}, {}, {}}}),
    with_pixels(kCommon, "RNG19_RFL8_SIG16_NIR16_DUAL", 16,
                {{{0, 19}, {24, 8}, {64, 16}, {96, 16}, {19, 5}, {32, 19}, {56, 8}, {80, 16}, {51, 5}}}),
    with_pixels(kCommon, "RNG15_RFL8_NIR8", 4, {{{0, 15, 3}, {16, 8}, {}, {24, 8, 4}, {15, 1}, {}, {}, {}, {}}}),
    with_pixels(kCommon, "RNG15_RFL8_NIR8_DUAL", 8, kRng15Dual),
    with_pixels(fusa_header(kCommon), "FUSA_RNG15_RFL8_NIR8_DUAL", 8, kRng15Dual),
};

constexpr std::uint64_t low_bits(int bits) {
    return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

}  // namespace

std::uint64_t BitField::read(const std::byte* base) const {
    const std::byte* first = base + bit_offset / 8;
    const int skipped = bit_offset % 8;
    const auto cut = [&](std::uint64_t word) { return ((word >> skipped) & low_bits(bits)) << shift; };
    const auto load = [&]<class T>(T word) {
        std::memcpy(&word, first, sizeof word);
        return cut(word);
    };
    const int bytes = (skipped + bits + 7) / 8;
    switch (bytes) {
        case 2:
            return load(std::uint16_t{});
        case 4:
            return load(std::uint32_t{});
        case 8:
            return load(std::uint64_t{});
        default:
            std::uint64_t word = 0;
            for (int i = 0; i < bytes; ++i) word |= static_cast<std::uint64_t>(first[i]) << (8 * i);
            return cut(word);
    }
}

void BitField::write(std::byte* base, std::uint64_t value) const {
    std::byte* first = base + bit_offset / 8;
    const int skipped = bit_offset % 8;
    const int bytes = (skipped + bits + 7) / 8;
    const std::uint64_t mask = low_bits(bits) << skipped;
    const std::uint64_t word = ((value >> shift) << skipped) & mask;
    for (int i = 0; i < bytes; ++i) {
        const auto kept = static_cast<std::byte>(~(mask >> (8 * i)));
        first[i] = (first[i] & kept) | static_cast<std::byte>(word >> (8 * i));
    }
}

std::int32_t PacketFormat::frame_distance(std::uint32_t from, std::uint32_t to) const {
    const std::uint32_t difference = to - from;
    if (frame_id_bits() == 16) return static_cast<std::int16_t>(static_cast<std::uint16_t>(difference));
    return static_cast<std::int32_t>(difference);
}

std::span<const PacketFormat> packet_formats() {
    return kFormats;
}

const PacketFormat* find_packet_format(std::string_view name) {
    const auto found = std::find_if(kFormats.begin(), kFormats.end(), [&](const auto& f) { return f.name == name; });
    return found == kFormats.end() ? nullptr : &*found;
}

std::string known_packet_formats() {
    std::string names;
    for (const PacketFormat& format : kFormats) {
        if (!names.empty()) names += ", ";
        names += format.name;
    }
    return names;
}

PacketLayout::PacketLayout(const PacketFormat& format, int rows, int columns_per_packet)
    : format_(&format),
      rows_(rows),
      columns_(columns_per_packet),
      column_bytes_(static_cast<std::size_t>(format.column_header_bytes + rows * format.pixel_bytes +
                                             format.column_footer_bytes)),
      packet_bytes_(static_cast<std::size_t>(format.packet_header_bytes + format.packet_footer_bytes) +
                    static_cast<std::size_t>(columns_per_packet) * column_bytes_),
      status_offset_(format.status_in_footer ? column_bytes_ - static_cast<std::size_t>(format.column_footer_bytes)
                                             : 0) {}

PacketHeader PacketLayout::read_packet_header(std::span<const std::byte> packet) const {
    PacketHeader header;
    if (!format_->packet_frame_id.present()) {
        // Majority vote (Boyer and Moore): one damaged column must not move the whole packet to another frame.
        int votes = 0;
        for (int column = 0; column < columns_; ++column) {
            const auto id =
                static_cast<std::uint32_t>(format_->column_frame_id.read(packet.data() + column_offset(column)));
            if (votes == 0) header.frame_id = id;
            votes += id == header.frame_id ? 1 : -1;
        }
        return header;
    }
    header.type = static_cast<std::uint16_t>(format_->packet_type.read(packet.data()));
    header.frame_id = static_cast<std::uint32_t>(format_->packet_frame_id.read(packet.data()));
    header.init_id = static_cast<std::uint32_t>(format_->init_id.read(packet.data()));
    header.serial_number = format_->serial_number.read(packet.data());
    header.alert_flags = static_cast<std::uint8_t>(format_->alert_flags.read(packet.data()));
    return header;
}

void PacketLayout::write_packet_header(std::span<std::byte> packet, const PacketHeader& header) const {
    format_->packet_type.write(packet.data(), header.type);
    format_->packet_frame_id.write(packet.data(), header.frame_id);
    format_->init_id.write(packet.data(), header.init_id);
    format_->serial_number.write(packet.data(), header.serial_number);
    format_->alert_flags.write(packet.data(), header.alert_flags);
}

ColumnHeader PacketLayout::read_column_header(std::span<const std::byte> packet, int column) const {
    const std::byte* base = packet.data() + column_offset(column);
    ColumnHeader header;
    header.time_ns = format_->time_ns.read(base);
    header.measurement_id = static_cast<std::uint16_t>(format_->measurement_id.read(base));
    header.frame_id = static_cast<std::uint16_t>(format_->column_frame_id.read(base));
    header.encoder_count = static_cast<std::uint32_t>(format_->encoder_count.read(base));
    header.status = static_cast<std::uint32_t>(format_->status.read(base + status_offset_));
    return header;
}

void PacketLayout::write_column_header(std::span<std::byte> packet, int column, const ColumnHeader& header) const {
    std::byte* base = packet.data() + column_offset(column);
    format_->time_ns.write(base, header.time_ns);
    format_->measurement_id.write(base, header.measurement_id);
    format_->column_frame_id.write(base, header.frame_id);
    format_->encoder_count.write(base, header.encoder_count);
    format_->status.write(base + status_offset_, header.status);
}

std::uint32_t PacketLayout::read_pixel(std::span<const std::byte> packet, int column, int row, PixelField field) const {
    return static_cast<std::uint32_t>(format_->field(field).read(packet.data() + pixel_offset(column, row)));
}

void PacketLayout::write_pixel(std::span<std::byte> packet, int column, int row, PixelField field,
                               std::uint32_t value) const {
    format_->field(field).write(packet.data() + pixel_offset(column, row), value);
}

}  // namespace dlod::driver
