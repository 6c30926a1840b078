#include "driver/packet_format.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

namespace dlod::driver {
namespace {

TEST(PacketFormat, SizesAreThoseOnTheWire) {
    const std::map<std::string, std::size_t> payload_at_128_rows{{"LEGACY", 24896},
                                                                 {"RNG19_RFL8_SIG16_NIR16", 24832},
                                                                 {"RNG15_RFL8_NIR8", 8448},
                                                                 {"RNG19_RFL8_SIG16_NIR16_DUAL", 33024},
                                                                 {"RNG15_RFL8_NIR8_DUAL", 16640},
                                                                 {"FUSA_RNG15_RFL8_NIR8_DUAL", 16640}};
    EXPECT_EQ(packet_formats().size(), payload_at_128_rows.size());
    for (const auto& [name, bytes] : payload_at_128_rows) {
        const PacketFormat* format = find_packet_format(name);
        ASSERT_NE(format, nullptr) << name;
        EXPECT_EQ(PacketLayout(*format, 128, 16).packet_bytes(), bytes) << name;
        EXPECT_NE(known_packet_formats().find(name), std::string::npos);
    }
    EXPECT_EQ(PacketLayout(*find_packet_format("LEGACY"), 32, 16).packet_bytes(), 6464U);
    EXPECT_EQ(find_packet_format("RNG15_RFL8_WIN8"), nullptr);
}

TEST(PacketFormat, PixelFieldsDoNotOverlapNorCrossWords) {
    for (const PacketFormat& format : packet_formats()) {
        EXPECT_EQ(format.pixel_bytes % 4, 0) << format.name;
        std::vector<int> uses(static_cast<std::size_t>(8 * format.pixel_bytes), 0);
        for (const BitField& field : format.pixel) {
            if (!field.present()) continue;
            ASSERT_LE(field.bit_offset + field.bits, 8 * format.pixel_bytes) << format.name;
            // The decoder cuts each field out of one aligned word.
            EXPECT_EQ(field.bit_offset / 32, (field.bit_offset + field.bits - 1) / 32) << format.name;
            for (int bit = 0; bit < field.bits; ++bit) ++uses[static_cast<std::size_t>(field.bit_offset + bit)];
        }
        for (const int n : uses) EXPECT_LE(n, 1) << format.name;
        EXPECT_TRUE(format.field(PixelField::kRange).present()) << format.name;
    }
}

TEST(PacketFormat, WritingAFieldLeavesItsNeighboursAlone) {
    const std::vector<BitField> fields{{0, 64, 0}, {3, 20, 0}, {15, 1, 0}, {56, 40, 0},
                                       {0, 15, 3}, {51, 5, 0}, {24, 8, 4}};
    for (const BitField& field : fields) {
        for (const std::byte background : {std::byte{0x00}, std::byte{0xFF}}) {
            const std::uint64_t mask = field.bits == 64 ? ~0ULL : (1ULL << field.bits) - 1;
            const std::uint64_t value = (0xA5C3'96F1'7B2D'E84BULL & mask) << field.shift;
            std::vector<std::byte> bytes(16, background);
            field.write(bytes.data(), value);
            EXPECT_EQ(field.read(bytes.data()), value);
            field.write(bytes.data(), background == std::byte{0xFF} ? mask << field.shift : 0);
            EXPECT_EQ(bytes, std::vector<std::byte>(16, background)) << field.bit_offset;
        }
    }
}

TEST(PacketFormat, HeadersAndPixelsSurviveEncodingInEveryProfile) {
    for (const PacketFormat& format : packet_formats()) {
        const PacketLayout layout(format, 32, 8);
        std::vector<std::byte> bytes(layout.packet_bytes(), std::byte{0xFF});
        const bool legacy = format.name == "LEGACY";
        const std::uint32_t frame_id = format.frame_id_bits() == 32 ? 0xFEDCBA98 : 0xFEDC;
        layout.write_packet_header(
            bytes, {.frame_id = frame_id, .init_id = 0xABCDEF, .serial_number = 992600000001, .alert_flags = 7});
        for (int i = 0; i < layout.columns(); ++i) {
            layout.write_column_header(bytes, i,
                                       {.time_ns = 1'700'000'000'123'456'789ULL + static_cast<std::uint64_t>(i),
                                        .measurement_id = static_cast<std::uint16_t>(640 + i),
                                        .frame_id = 0xFEDC,
                                        .encoder_count = 88U * static_cast<std::uint32_t>(i),
                                        .status = layout.valid_status()});
            for (int row = 0; row < layout.rows(); ++row) {
                layout.write_pixel(bytes, i, row, PixelField::kRange, static_cast<std::uint32_t>(8 * (row * 100 + i)));
            }
        }
        const PacketHeader header = layout.read_packet_header(bytes);
        EXPECT_EQ(header.frame_id, frame_id) << format.name;
        EXPECT_EQ(header.type, kLidarPacketType) << format.name;
        EXPECT_EQ(header.init_id, legacy ? 0U : 0xABCDEFU) << format.name;
        EXPECT_EQ(header.serial_number, legacy ? 0U : 992600000001U) << format.name;
        EXPECT_EQ(header.alert_flags, legacy ? 0 : 7) << format.name;
        for (int i = 0; i < layout.columns(); ++i) {
            const ColumnHeader column = layout.read_column_header(bytes, i);
            EXPECT_EQ(column.time_ns, 1'700'000'000'123'456'789ULL + static_cast<std::uint64_t>(i));
            EXPECT_EQ(column.measurement_id, 640 + i);
            EXPECT_EQ(column.encoder_count, legacy ? 88U * static_cast<std::uint32_t>(i) : 0U);
            EXPECT_TRUE(layout.is_valid(column));
            for (int row = 0; row < layout.rows(); ++row) {
                EXPECT_EQ(layout.read_pixel(bytes, i, row, PixelField::kRange),
                          static_cast<std::uint32_t>(8 * (row * 100 + i)));
            }
        }
    }
}

TEST(PacketFormat, LegacyFrameIdIsThatOfMostColumns) {
    const PacketLayout layout(*find_packet_format("LEGACY"), 16, 16);
    std::vector<std::byte> bytes(layout.packet_bytes());
    for (int i = 0; i < 16; ++i) {
        layout.write_column_header(bytes, i, {.frame_id = static_cast<std::uint16_t>(i < 5 ? 100 + i : 77)});
    }
    EXPECT_EQ(layout.read_packet_header(bytes).frame_id, 77U);
}

TEST(PacketFormat, FrameIdsWrap) {
    const PacketFormat& narrow = *find_packet_format("RNG15_RFL8_NIR8");
    EXPECT_EQ(narrow.frame_distance(65535, 0), 1);
    EXPECT_EQ(narrow.frame_distance(0, 65535), -1);
    EXPECT_EQ(narrow.frame_distance(65530, 4), 10);
    EXPECT_EQ(narrow.frame_distance(70000, 70000 % 65536), 0);
    const PacketFormat& wide = *find_packet_format("FUSA_RNG15_RFL8_NIR8_DUAL");
    EXPECT_EQ(wide.frame_distance(65535, 65536), 1);
    EXPECT_EQ(wide.frame_distance(0xFFFFFFFF, 0), 1);
    EXPECT_EQ(wide.frame_distance(65535, 0), -65535);
}

}  // namespace
}  // namespace dlod::driver
