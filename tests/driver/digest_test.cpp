// Digests that Ouster published with real captures: every byte that the packets carry must come out as it went in.
#include <gtest/gtest.h>
#include <nettle/md5.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "driver/frame_builder.hpp"
#include "driver/frame_viewer.hpp"
#include "driver/pcap_source.hpp"
#include "tests/support/test_data.hpp"

namespace dlod::driver {
namespace {

using nlohmann::json;

/// Running MD5 of little-endian numbers.
class Md5 {
  public:
    Md5() { md5_init(&state_); }
    template <class T>
    void add(const T& number) {
        md5_update(&state_, sizeof(number), reinterpret_cast<const std::uint8_t*>(&number));
    }
    template <class T>
    void add(const std::vector<T>& numbers) {
        md5_update(&state_, numbers.size() * sizeof(T), reinterpret_cast<const std::uint8_t*>(numbers.data()));
    }
    std::string hex() {
        std::uint8_t digest[MD5_DIGEST_SIZE];
        md5_digest(&state_, sizeof(digest), digest);
        std::string text;
        for (const std::uint8_t byte : digest) {
            text += "0123456789abcdef"[byte / 16];
            text += "0123456789abcdef"[byte % 16];
        }
        return text;
    }

  private:
    md5_ctx state_;
};

/// A field as the digests call it: which bits of a pixel, and the bytes of the number that is hashed.
struct DigestField {
    BitField bits;
    int bytes;
};

std::map<std::string, DigestField> digest_fields(const PacketFormat& format) {
    const std::map<std::string, std::pair<PixelField, int>> names{
        {"RANGE", {PixelField::kRange, 4}},    {"RANGE2", {PixelField::kRange2, 4}},
        {"SIGNAL", {PixelField::kSignal, 2}},  {"SIGNAL2", {PixelField::kSignal2, 2}},
        {"NEAR_IR", {PixelField::kNearIr, 2}}, {"REFLECTIVITY", {PixelField::kReflectivity, 1}},
        {"FLAGS", {PixelField::kFlags, 1}},    {"REFLECTIVITY2", {PixelField::kReflectivity2, 1}},
        {"FLAGS2", {PixelField::kFlags2, 1}}};
    std::map<std::string, DigestField> fields;
    for (const auto& [name, field] : names) {
        if (format.field(field.first).present()) fields[name] = {format.field(field.first), field.second};
    }
    for (int word = 0; word < format.pixel_bytes / 4; ++word) {
        fields["RAW32_WORD" + std::to_string(word + 1)] = {{static_cast<std::uint16_t>(32 * word), 32, 0}, 4};
    }
    return fields;
}

void add_number(Md5& md5, std::uint64_t value, int bytes) {
    if (bytes == 1) md5.add(static_cast<std::uint8_t>(value));
    if (bytes == 2) md5.add(static_cast<std::uint16_t>(value));
    if (bytes == 4) md5.add(static_cast<std::uint32_t>(value));
}

/// The running hashes over all lidar packets, through the packet table.
class PacketHashes {
  public:
    explicit PacketHashes(const SensorInfo& info) : layout_(info.layout()), fields_(digest_fields(*info.format)) {}

    void add(std::span<const std::byte> packet) {
        for (int i = 0; i < layout_.columns(); ++i) {
            const ColumnHeader column = layout_.read_column_header(packet, i);
            hashes_["TIMESTAMP"].add(column.time_ns);
            hashes_["ENCODER_COUNT"].add(column.encoder_count);
            hashes_["MEASUREMENT_ID"].add(column.measurement_id);
            hashes_["STATUS"].add(column.status);
            hashes_["FRAME_ID"].add(column.frame_id);
        }
        for (const auto& [name, field] : fields_) {
            Md5& hash = hashes_[name];
            for (int row = 0; row < layout_.rows(); ++row) {
                for (int i = 0; i < layout_.columns(); ++i) {
                    add_number(hash, field.bits.read(packet.data() + layout_.pixel_offset(i, row)), field.bytes);
                }
            }
        }
    }
    std::string hex(const std::string& name) { return hashes_.contains(name) ? hashes_[name].hex() : "not computed"; }

  private:
    PacketLayout layout_;
    std::map<std::string, DigestField> fields_;
    std::map<std::string, Md5> hashes_;
};

/// Hash of an image of the frame builder, staggered again.
template <class T>
std::string staggered_hash(const Image<T>& image, const SensorModel& model) {
    std::vector<T> staggered(image.size());
    for (int row = 0; row < model.height; ++row) {
        for (int column = 0; column < model.width; ++column) {
            const int m = model.measurement_of(row, column);
            staggered[static_cast<std::size_t>(row * model.width + m)] = image(row, column);
        }
    }
    Md5 md5;
    md5.add(staggered);
    return md5.hex();
}

/// Hashes of a frame that the frame builder emitted; fields that it does not keep are read through the packet table.
class FrameHashes {
  public:
    FrameHashes(const Frame& frame, const SensorInfo& info, const std::vector<std::vector<std::byte>>& packets)
        : frame_(frame), info_(info), packets_(packets) {}

    std::string hex(const std::string& name) const {
        const PacketFormat& format = *info_.format;
        if (name == "FRAME_ID") return std::to_string(frame_.header.frame_id);
        if (name == "TIMESTAMP") return hash(frame_.columns.time_ns);
        if (name == "STATUS")
            return hash(std::vector<std::uint64_t>(frame_.columns.status.begin(), frame_.columns.status.end()));
        if (name == "RANGE") return staggered_hash(frame_.raw.range_mm, info_.model);
        if (name == "REFLECTIVITY") return staggered_hash(frame_.raw.reflectivity, info_.model);
        if (name == "NEAR_IR") return staggered_hash(frame_.raw.near_ir, info_.model);
        if (name == "SIGNAL" && format.field(PixelField::kSignal).present())
            return staggered_hash(frame_.raw.signal, info_.model);
        if (name == "MEASUREMENT_ID") return column_hash<std::uint16_t>(&ColumnHeader::measurement_id);
        if (name == "ENCODER_COUNT") return column_hash<std::uint64_t>(&ColumnHeader::encoder_count);
        const auto fields = digest_fields(format);
        return fields.contains(name) ? pixel_hash(fields.at(name)) : "not computed";
    }

  private:
    template <class T>
    static std::string hash(const std::vector<T>& values) {
        Md5 md5;
        md5.add(values);
        return md5.hex();
    }

    template <class T, class Member>
    std::string column_hash(Member member) const {
        const PacketLayout layout = info_.layout();
        std::vector<T> values;
        for (const auto& packet : packets_) {
            for (int i = 0; i < layout.columns(); ++i)
                values.push_back(static_cast<T>(layout.read_column_header(packet, i).*member));
        }
        return hash(values);
    }

    std::string pixel_hash(const DigestField& field) const {
        const PacketLayout layout = info_.layout();
        Md5 md5;
        for (int row = 0; row < layout.rows(); ++row) {
            for (const auto& packet : packets_) {
                for (int i = 0; i < layout.columns(); ++i) {
                    add_number(md5, field.bits.read(packet.data() + layout.pixel_offset(i, row)), field.bytes);
                }
            }
        }
        return md5.hex();
    }

    const Frame& frame_;
    const SensorInfo& info_;
    const std::vector<std::vector<std::byte>>& packets_;
};

class Digests : public ::testing::TestWithParam<std::string> {};

TEST_P(Digests, AreReproduced) {
    const auto metadata = dlod::test::data_path("ouster/" + GetParam() + ".json");
    if (!metadata) GTEST_SKIP() << "no data/ouster/" << GetParam();
    const SensorInfo info = load_metadata(*metadata);
    std::ifstream file(*dlod::test::data_path("ouster/" + GetParam() + "_digest.json"));
    const json digest = json::parse(file);

    PcapSource source(*dlod::test::data_path("ouster/" + GetParam() + ".pcap"));
    PacketHashes packet_hashes(info);
    std::vector<std::vector<std::byte>> packets;  // of the capture's one frame, in firing order
    Frame frame(info.model);
    bool acquired = false;
    int emitted = 0;
    FrameBuilder builder(
        info, {}, [&]() -> Frame* { return std::exchange(acquired, true) ? nullptr : &frame; },
        [&](Frame*) { ++emitted; });
    for (PacketBatch batch = source.next(); batch.status == SourceStatus::kPackets; batch = source.next()) {
        for (const Packet& packet : batch.packets) {
            builder.push(packet);
            if (packet.data.size() != info.layout().packet_bytes()) continue;
            packet_hashes.add(packet.data);
            packets.emplace_back(packet.data.begin(), packet.data.end());
        }
    }
    for (const auto& [name, expected] : digest.at("packet_hash").items()) {
        EXPECT_EQ(packet_hashes.hex(name), expected.get<std::string>()) << "packet_hash." << name;
    }
    const json& frames = digest.contains("scans") ? digest.at("scans") : digest.at("frames");
    ASSERT_EQ(frames.size(), 1U);
    ASSERT_EQ(emitted, 1);
    const FrameHashes hashes(frame, info, packets);
    for (const auto& [name, expected] : frames[0].items()) {
        EXPECT_EQ(hashes.hex(name), expected.get<std::string>()) << "scans[0]." << name;
    }
}

INSTANTIATE_TEST_SUITE_P(Ouster, Digests,
                         ::testing::Values("OS-0-128-U1_v2.3.0_1024x10", "OS-0-32-U1_v2.2.0_1024x10",
                                           "OS-2-32-U0_v2.0.0_1024x10"),
                         [](const auto& capture) {
                             std::string name = capture.param;
                             for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                             return name;
                         });

/// Counters and emitted frames of a whole capture.
struct Replay {
    std::vector<FrameHeader> frames;
    std::vector<std::size_t> imu_samples;
    FrameBuilderCounters counters;
};

Replay replay(const std::string& metadata, const std::string& capture) {
    const SensorInfo info = load_metadata(*dlod::test::data_path("ouster/" + metadata));
    PcapSource source(*dlod::test::data_path("ouster/" + capture));
    Replay result;
    FrameViewer frames(info, [&](const Frame& frame) {
        result.frames.push_back(frame.header);
        result.imu_samples.push_back(frame.imu.size());
    });
    for (PacketBatch batch = source.next(); batch.status == SourceStatus::kPackets; batch = source.next()) {
        for (const Packet& packet : batch.packets) frames.push(packet);
    }
    frames.flush();
    result.counters = frames.counters();
    return result;
}

TEST(RealCaptures, ThreeTurnsOfAnOs1) {
    if (!dlod::test::data_path("ouster/OS-1-128_v2.3.0_1024x10_lb_n3.pcap")) GTEST_SKIP() << "no data/ouster";
    const Replay got = replay("OS-1-128_v2.3.0_1024x10.json", "OS-1-128_v2.3.0_1024x10_lb_n3.pcap");
    ASSERT_EQ(got.frames.size(), 3U);
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(got.frames[k].frame_id, 1795 + k);
        EXPECT_EQ(got.frames[k].valid_columns, 1024);
    }
    EXPECT_EQ(got.imu_samples, (std::vector<std::size_t>{8, 10, 10}))
        << "the first sample is of 21 ms after the first column";
    EXPECT_EQ(got.counters.lidar_packets.value(), 192U);
    EXPECT_EQ(got.counters.imu_packets.value(), 30U);
    EXPECT_EQ(got.counters.mistimed_columns.value(), 0U);
    EXPECT_EQ(got.counters.clock_jumps.value(), 0U);
}

TEST(RealCaptures, AColumnWindow) {
    if (!dlod::test::data_path("ouster/windowed_frame1.pcap")) GTEST_SKIP() << "no data/ouster";
    const Replay got = replay("windowed_frame1_0.json", "windowed_frame1.pcap");
    ASSERT_EQ(got.frames.size(), 1U);
    EXPECT_EQ(got.frames[0].frame_id, 1553U);
    EXPECT_EQ(got.frames[0].valid_columns, 256);
    EXPECT_TRUE(got.frames[0].usable);
    EXPECT_EQ(got.counters.invalid_columns.value(), 0U) << "those outside of the window are not meant to be valid";
    EXPECT_EQ(got.counters.incomplete_frames.value(), 0U);
}

TEST(RealCaptures, OfAnotherSensorGiveCountsButNoFrames) {
    if (!dlod::test::data_path("ouster/windowed_frame1.pcap")) GTEST_SKIP() << "no data/ouster";
    const Replay other_size = replay("OS-2-32-U0_v2.0.0_1024x10.json", "OS-1-128_v2.3.0_1024x10_lb_n3.pcap");
    EXPECT_TRUE(other_size.frames.empty());
    EXPECT_EQ(other_size.counters.wrong_size_packets.value(), 192U);
    const Replay other_serial = replay("OS-0-128-U1_v2.3.0_1024x10.json", "OS-1-128_v2.3.0_1024x10_lb_n3.pcap");
    EXPECT_TRUE(other_serial.frames.empty());
    EXPECT_EQ(other_serial.counters.foreign_packets.value(), 192U);
}

}  // namespace
}  // namespace dlod::driver
