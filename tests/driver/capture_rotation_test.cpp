#include "driver/capture_rotation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <vector>

#include "driver/network_address.hpp"
#include "driver/pcap_source.hpp"
#include "tests/support/network_bytes.hpp"
#include "tests/support/small_disk.hpp"

namespace dlod::driver {
namespace {

using test::ByteVector;
using test::payload_pattern;
using test::ScratchFolder;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;

bool write(CaptureRotation& rotation, std::uint32_t i, std::int64_t time_ns) {
    const ByteVector data = payload_pattern(8448, i);
    return rotation.write({.data = data,
                           .receive_ns = time_ns,
                           .sender_address = ipv4_address(10, 0, 0, 7),
                           .sender_port = 7502,
                           .destination_port = 7502});
}

std::vector<std::filesystem::path> files(const std::filesystem::path& folder, const std::string& extension) {
    std::vector<std::filesystem::path> all;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() == extension) all.push_back(entry.path());
    }
    std::sort(all.begin(), all.end());
    return all;
}

TEST(CaptureRotation, IsBoundedInSizeAndNumber) {
    const ScratchFolder scratch;
    const auto folder = scratch.file("recordings");
    constexpr std::uint32_t kPackets = 1000;
    {
        CaptureRotation rotation({.folder = folder, .file_bytes = 1 << 20, .files = 3, .metadata = "{\"a\": 1}"});
        for (std::uint32_t i = 0; i < kPackets; ++i) {
            ASSERT_TRUE(write(rotation, i, kStart_ns + i * 1000)) << rotation.error();
            EXPECT_LE(files(folder, ".pcap").size(), 3U);
        }
        EXPECT_EQ(rotation.files(), 9U);
    }
    const auto captures = files(folder, ".pcap");
    ASSERT_EQ(captures.size(), 3U);
    EXPECT_EQ(captures[2].filename(), "dlod_000009_20231114T221320Z.pcap");
    EXPECT_EQ(files(folder, ".json").size(), 3U);
    std::ifstream json(files(folder, ".json")[0]);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(json), {}), "{\"a\": 1}");

    // The files go on where the one before ends, to the last packet.
    std::uint32_t next = 0;
    for (const auto& capture : captures) {
        EXPECT_LE(std::filesystem::file_size(capture), 1U << 20);
        PcapSource source(capture);
        for (PacketBatch batch = source.next(); batch.status == SourceStatus::kPackets; batch = source.next()) {
            const Packet& p = batch.packets[0];
            if (next == 0) next = static_cast<std::uint32_t>((p.receive_ns - kStart_ns) / 1000);
            EXPECT_EQ(ByteVector(p.data.begin(), p.data.end()), payload_pattern(8448, next));
            EXPECT_EQ(p.receive_ns, kStart_ns + next * 1000);
            ++next;
        }
        EXPECT_TRUE(source.take_warnings().empty());
    }
    EXPECT_EQ(next, kPackets);
}

TEST(CaptureRotation, CountsThoseOfEarlierRunsAndLeavesOthersAlone) {
    const ScratchFolder scratch;
    scratch.write("dlod_000041_20200101T000000Z.pcap", {});
    scratch.write("dlod_000041_20200101T000000Z.json", {});
    scratch.write("dlod_000042_20200101T000000Z.pcap", {});
    scratch.write("dlod_notes.pcap", {});
    scratch.write("other_000001_x.pcap", {});
    CaptureRotation rotation({.folder = scratch.file(""), .files = 2});
    ASSERT_TRUE(write(rotation, 0, kStart_ns));
    const auto left = files(scratch.file(""), ".pcap");
    ASSERT_EQ(left.size(), 4U);
    EXPECT_EQ(left[0].filename(), "dlod_000042_20200101T000000Z.pcap");
    EXPECT_EQ(left[1].filename(), "dlod_000043_20231114T221320Z.pcap");
    EXPECT_TRUE(files(scratch.file(""), ".json").empty());
}

TEST(CaptureRotation, TriesAgainAfterAFailure) {
    const ScratchFolder scratch;
    scratch.write("blocked", {});  // a file where the folder should be
    CaptureRotation rotation({.folder = scratch.file("blocked")});
    EXPECT_FALSE(write(rotation, 0, kStart_ns));
    EXPECT_NE(rotation.error().find("blocked"), std::string::npos) << rotation.error();
    std::filesystem::remove(scratch.file("blocked"));
    EXPECT_FALSE(write(rotation, 1, kStart_ns + 9 * kSecond));
    EXPECT_TRUE(write(rotation, 2, kStart_ns + 11 * kSecond));
    EXPECT_TRUE(rotation.error().empty());
    EXPECT_TRUE(rotation.flush());
}

TEST(CaptureRotation, AFolderThatCannotBeUsedIsNamedBeforeAPacketComes) {
    const ScratchFolder scratch;
    scratch.write("blocked", {});
    CaptureRotation blocked({.folder = scratch.file("blocked")});
    EXPECT_FALSE(blocked.prepare());
    EXPECT_NE(blocked.error().find("blocked"), std::string::npos) << blocked.error();
    CaptureRotation usable({.folder = scratch.file("new") / "folder"});
    EXPECT_TRUE(usable.prepare()) << usable.error();
    EXPECT_TRUE(usable.error().empty());
}

TEST(CaptureRotation, AFullDiskCostsNeitherWhatWasRecordedNorLeavesFilesWithoutPackets) {
    const test::SmallDisk disk(16 << 20);
    if (!disk.usable()) GTEST_SKIP() << "no file system can be mounted here";
    CaptureRotation rotation({.folder = disk.path(), .file_bytes = 2 << 20, .files = 10, .metadata = "{}"});
    std::uint32_t n = 0;
    std::int64_t time_ns = kStart_ns;
    while (rotation.files() < 3) ASSERT_TRUE(write(rotation, n++, time_ns += 1000)) << rotation.error();
    ASSERT_TRUE(rotation.flush());

    disk.fill();
    while (rotation.error().empty()) write(rotation, n++, time_ns += 1000);
    EXPECT_NE(rotation.error().find("No space left"), std::string::npos) << rotation.error();
    const auto recorded = files(disk.path(), ".pcap");
    ASSERT_GE(recorded.size(), 3U);
    for (int attempt = 0; attempt < 20; ++attempt) {
        EXPECT_FALSE(write(rotation, n++, time_ns += 11 * kSecond));
        EXPECT_FALSE(rotation.error().empty());
    }
    const auto left = files(disk.path(), ".pcap");
    EXPECT_EQ(left, recorded);
    EXPECT_EQ(files(disk.path(), ".json").size(), left.size());
    for (const auto& capture : left) {
        PcapSource source(capture);
        std::size_t packets = 0;
        for (auto batch = source.next(); batch.status == SourceStatus::kPackets; batch = source.next()) {
            packets += batch.packets.size();
        }
        EXPECT_GT(packets, 0U) << capture;
        EXPECT_TRUE(source.take_warnings().empty()) << capture;
    }
    disk.clear();
    EXPECT_TRUE(write(rotation, n++, time_ns += 11 * kSecond)) << rotation.error();
    EXPECT_TRUE(rotation.error().empty());
}

}  // namespace
}  // namespace dlod::driver
