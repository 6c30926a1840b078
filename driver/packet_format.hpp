// The layouts of Ouster's lidar packets as a table of data. Decoder, simulator and tests all work from this table:
// every field can be read and written, so a packet is encoded like this:
//
//     const PacketLayout layout(find_packet_format("RNG15_RFL8_NIR8"), rows, columns_per_packet);
//     std::vector<std::byte> bytes(layout.packet_bytes());
//     layout.write_packet_header(bytes, header);
//     layout.write_column_header(bytes, i, column);
//     layout.write_pixel(bytes, i, row, PixelField::kRange, range_mm);
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace dlod::driver {

/// Unsigned little-endian number of `bits` bits at `bit_offset`; what it stands for is the number << shift.
struct BitField {
    std::uint16_t bit_offset = 0;
    std::uint8_t bits = 0;  ///< 0: the format lacks the field; at most 57 unless it starts on a whole byte
    std::uint8_t shift = 0;

    constexpr bool present() const { return bits != 0; }
    /// Value of the field in the bytes from `base` on; touches no byte outside of the field. 0 where it is not present.
    std::uint64_t read(const std::byte* base) const;
    /// Writes the value, whose bits below `shift` and above the field's width are cut off; nothing where not present.
    void write(std::byte* base, std::uint64_t value) const;
};

enum class PixelField : std::uint8_t {
    kRange,  ///< mm, from the beam's origin; in dual profiles the strongest return
    kReflectivity,
    kSignal,
    kNearIr,
    kFlags,
    kRange2,  ///< second return
    kReflectivity2,
    kSignal2,
    kFlags2,
};
inline constexpr std::size_t kPixelFieldCount = 9;

/// One lidar profile. Offsets count from the start of the part that the field is in.
struct PacketFormat {
    std::string_view name{};  ///< Ouster's, as in udp_profile_lidar
    int packet_header_bytes = 0;
    int packet_footer_bytes = 0;
    int column_header_bytes = 0;
    int column_footer_bytes = 0;
    int pixel_bytes = 0;

    // In the packet's header.
    BitField packet_type{};
    BitField packet_frame_id{};
    BitField init_id{};
    BitField serial_number{};
    BitField alert_flags{};

    // In the column's header; the status of LEGACY is in the column's footer.
    BitField time_ns{};
    BitField measurement_id{};
    BitField column_frame_id{};
    BitField encoder_count{};
    BitField status{};
    bool status_in_footer = false;
    std::uint32_t valid_status = 0;  ///< a column is valid when all these bits are set

    std::array<BitField, kPixelFieldCount> pixel{};  ///< indexed by PixelField

    const BitField& field(PixelField f) const { return pixel[static_cast<std::size_t>(f)]; }
    int frame_id_bits() const { return packet_frame_id.present() ? packet_frame_id.bits : column_frame_id.bits; }
    /// Signed number of frames from frame id `from` to `to`, across the wrap.
    std::int32_t frame_distance(std::uint32_t from, std::uint32_t to) const;
};

inline constexpr std::uint16_t kLidarPacketType = 1;

/// All profiles that dlod decodes.
std::span<const PacketFormat> packet_formats();

/// The profile of that name, nullptr when dlod does not know it.
const PacketFormat* find_packet_format(std::string_view name);

/// Names of all known profiles, comma-separated, for messages.
std::string known_packet_formats();

struct PacketHeader {
    std::uint16_t type = kLidarPacketType;
    std::uint32_t frame_id = 0;
    std::uint32_t init_id = 0;
    std::uint64_t serial_number = 0;
    std::uint8_t alert_flags = 0;
};

struct ColumnHeader {
    std::uint64_t time_ns = 0;
    std::uint16_t measurement_id = 0;
    std::uint16_t frame_id = 0;       ///< LEGACY only, else 0
    std::uint32_t encoder_count = 0;  ///< LEGACY only, else 0
    std::uint32_t status = 0;
};

/// A format with a sensor's number of rows and columns a packet: sizes, and access to each part of a packet.
/// All spans given must be packet_bytes() long; columns and rows count from 0.
class PacketLayout {
  public:
    PacketLayout(const PacketFormat& format, int rows, int columns_per_packet);

    const PacketFormat& format() const { return *format_; }
    int rows() const { return rows_; }
    int columns() const { return columns_; }
    /// Size of the UDP payload.
    std::size_t packet_bytes() const { return packet_bytes_; }
    std::size_t column_bytes() const { return column_bytes_; }
    std::size_t column_offset(int column) const {
        return static_cast<std::size_t>(format_->packet_header_bytes) +
               static_cast<std::size_t>(column) * column_bytes_;
    }
    std::size_t pixel_offset(int column, int row) const {
        return column_offset(column) + static_cast<std::size_t>(format_->column_header_bytes) +
               static_cast<std::size_t>(row) * static_cast<std::size_t>(format_->pixel_bytes);
    }

    /// LEGACY has no packet header: the frame id is then the one that most columns have, the rest are defaults.
    PacketHeader read_packet_header(std::span<const std::byte> packet) const;
    void write_packet_header(std::span<std::byte> packet, const PacketHeader& header) const;
    ColumnHeader read_column_header(std::span<const std::byte> packet, int column) const;
    void write_column_header(std::span<std::byte> packet, int column, const ColumnHeader& header) const;
    bool is_valid(const ColumnHeader& header) const {
        return (header.status & format_->valid_status) == format_->valid_status;
    }
    /// Status of a good column.
    std::uint32_t valid_status() const { return format_->valid_status; }

    std::uint32_t read_pixel(std::span<const std::byte> packet, int column, int row, PixelField field) const;
    void write_pixel(std::span<std::byte> packet, int column, int row, PixelField field, std::uint32_t value) const;

  private:
    const PacketFormat* format_;
    int rows_;
    int columns_;
    std::size_t column_bytes_;
    std::size_t packet_bytes_;
    std::size_t status_offset_;  ///< of the status field's base within a column
};

}  // namespace dlod::driver
