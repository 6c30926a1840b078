#include "driver/pcap_source.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/support/network_bytes.hpp"
#include "tests/support/test_data.hpp"

namespace dlod::driver {
namespace {

using test::ByteVector;
using test::capture_file;
using test::Checksum;
using test::FileKind;
using test::payload_pattern;
using test::Record;
using test::ScratchFolder;

constexpr std::int64_t kStart_ns = 1'700'000'000'123'456'789;

struct Delivered {
    ByteVector data;
    std::int64_t receive_ns = 0;
    std::uint16_t port = 0;
};

std::vector<Delivered> read_all(PacketSource& source) {
    std::vector<Delivered> all;
    for (;;) {
        const PacketBatch batch = source.next();
        if (batch.status != SourceStatus::kPackets) {
            EXPECT_EQ(batch.status, SourceStatus::kEnd);
            EXPECT_EQ(source.next().status, SourceStatus::kEnd);
            return all;
        }
        for (const Packet& p : batch.packets) {
            all.push_back({{p.data.begin(), p.data.end()}, p.receive_ns, p.destination_port});
        }
    }
}

std::string error_of(const std::filesystem::path& path) {
    try {
        PcapSource source(path);
    } catch (const SourceError& e) {
        return e.what();
    }
    return "";
}

ByteVector lidar_frame(std::uint32_t i, Checksum checksum = Checksum::kRight) {
    return test::link_frame(1, test::ip(test::udp(payload_pattern(1200, i), {.checksum = checksum}), {.id = i}));
}

/// `count` Ethernet records, a millisecond apart.
std::vector<Record> records(std::uint32_t count) {
    std::vector<Record> all;
    for (std::uint32_t i = 0; i < count; ++i) all.push_back({kStart_ns + i * 1'000'000, lidar_frame(i)});
    return all;
}

TEST(PcapSource, EveryFileKindAndLinkType) {
    const ScratchFolder folder;
    for (const FileKind kind : {FileKind::kMicrosecond, FileKind::kNanosecond, FileKind::kMicrosecondSwapped,
                                FileKind::kNanosecondSwapped, FileKind::kPcapng, FileKind::kPcapngNanosecond}) {
        const bool nano = kind == FileKind::kNanosecond || kind == FileKind::kNanosecondSwapped ||
                          kind == FileKind::kPcapngNanosecond;
        for (const int link : {0, 1, 101, 108, 113, 228, 229, 276}) {
            std::vector<Record> all;
            std::vector<ByteVector> sent;
            for (std::uint32_t i = 0; i < 8; ++i) {
                const bool ipv6 = link == 229 || (link != 228 && i % 2 == 1);
                const bool fragmented = i % 4 >= 2;
                const bool tagged = (link == 1 || link == 113 || link == 276) && i >= 4;
                sent.push_back(payload_pattern(6464, i));
                const ByteVector datagram = test::udp(sent.back(), {.ipv6 = ipv6});
                const test::IpFields fields{.ipv6 = ipv6, .id = i};
                const auto packets = fragmented ? test::ip_fragments(datagram, fields)
                                                : std::vector<ByteVector>{test::ip(datagram, fields)};
                for (const ByteVector& p : packets) {
                    all.push_back({kStart_ns + i * 1'000,
                                   test::link_frame(link, p, tagged ? std::vector{7U, 8U} : std::vector<unsigned>{})});
                }
            }
            const auto path = folder.write("capture", capture_file(kind, static_cast<std::uint32_t>(link), all));
            PcapSource source(path);
            const auto got = read_all(source);
            ASSERT_EQ(got.size(), sent.size()) << "link type " << link;
            for (std::size_t i = 0; i < got.size(); ++i) {
                EXPECT_EQ(got[i].data, sent[i]) << "link type " << link;
                EXPECT_EQ(got[i].port, 7502);
                const auto time_ns = kStart_ns + static_cast<std::int64_t>(i) * 1'000;
                EXPECT_EQ(got[i].receive_ns, nano ? time_ns : time_ns / 1000 * 1000);
            }
            EXPECT_TRUE(source.take_warnings().empty());
            EXPECT_EQ(source.counters().malformed.value(), 0U);
            EXPECT_EQ(source.progress(), 1.0);
        }
    }
}

TEST(PcapSource, SendersAndPorts) {
    const ScratchFolder folder;
    std::vector<Record> all;
    for (const std::uint16_t port : {7502, 7503, 53, 7502}) {
        all.push_back({kStart_ns, test::link_frame(1, test::ip(test::udp(payload_pattern(48, port), {.port = port})))});
    }
    const auto path = folder.write("capture", capture_file(FileKind::kPcapng, 1, all));
    PcapSource source(path, {.ports = {7502, 7503}, .reassembly = {}});
    const PacketBatch first = source.next();
    ASSERT_EQ(first.packets.size(), 1U);
    EXPECT_EQ(first.packets[0].sender_address, ipv4_address(10, 0, 0, 7));
    EXPECT_EQ(first.packets[0].sender_port, 50000);
    EXPECT_EQ(read_all(source).size(), 2U);
    EXPECT_EQ(source.counters().other_port.value(), 1U);
    EXPECT_EQ(source.counters().delivered.value(), 3U);
}

TEST(PcapSource, ForeignPacketsAreCountedByName) {
    const ScratchFolder folder;
    ByteVector arp = lidar_frame(1);
    arp[13] = std::byte{0x06};
    ByteVector wrong_length = test::link_frame(1, test::ip(test::udp(payload_pattern(48, 1), {.length_error = 5})));
    const std::vector<Record> all{{kStart_ns, arp},
                                  {kStart_ns, test::link_frame(1, test::ip(payload_pattern(60, 1), {.protocol = 6}))},
                                  {kStart_ns, lidar_frame(2), 100},
                                  {kStart_ns, wrong_length},
                                  {kStart_ns, ByteVector(5)},
                                  {kStart_ns, lidar_frame(3)}};
    PcapSource source(folder.write("capture", capture_file(FileKind::kNanosecond, 1, all)));
    EXPECT_EQ(read_all(source).size(), 1U);
    std::map<std::string, std::uint64_t> counts;
    source.visit_counters([&](std::string_view name, std::uint64_t n) { counts[std::string(name)] = n; });
    EXPECT_EQ(counts["capture_records"], 6U);
    EXPECT_EQ(counts["records_not_ip"], 1U);
    EXPECT_EQ(counts["packets_not_udp"], 1U);
    EXPECT_EQ(counts["packets_cut_short"], 1U);
    EXPECT_EQ(counts["packets_malformed"], 2U);
    EXPECT_EQ(counts["packets_delivered"], 1U);
    const auto warnings = source.take_warnings();
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find("tcpdump -s 0"), std::string::npos);
}

TEST(PcapSource, EverythingBeforeATruncationIsDelivered) {
    const ScratchFolder folder;
    for (const FileKind kind : {FileKind::kNanosecond, FileKind::kPcapng}) {
        const ByteVector whole = capture_file(kind, 1, records(5));
        for (const std::size_t missing : {1U, 100U, 1241U, 1255U}) {
            const ByteVector cut(whole.begin(), whole.end() - static_cast<std::ptrdiff_t>(missing));
            const auto path = folder.write("cut.pcap", cut);
            PcapSource source(path);
            const auto got = read_all(source);
            ASSERT_EQ(got.size(), 4U) << missing;
            EXPECT_EQ(got[3].data, payload_pattern(1200, 3));
            const auto warnings = source.take_warnings();
            ASSERT_EQ(warnings.size(), 1U);
            for (const char* part : {"cut.pcap", "record 4", "near byte"}) {
                EXPECT_NE(warnings[0].find(part), std::string::npos) << warnings[0];
            }
            EXPECT_EQ(source.counters().unreadable.value(), 1U);
        }
    }
}

TEST(PcapSource, FilesThatAreNoCapturesAreNamed) {
    const ScratchFolder folder;
    const auto text = folder.write("notes.txt", ByteVector(500, std::byte{'a'}));
    const auto nothing = folder.write("nothing.pcap", {});
    const auto wifi = folder.write("wifi.pcap", capture_file(FileKind::kNanosecond, 105, records(1)));
    EXPECT_NE(error_of(text).find("notes.txt: is no pcap"), std::string::npos) << error_of(text);
    EXPECT_NE(error_of(nothing).find("nothing.pcap"), std::string::npos) << error_of(nothing);
    EXPECT_NE(error_of(wifi).find("link type 105"), std::string::npos) << error_of(wifi);
    EXPECT_NE(error_of(folder.file("absent.pcap")).find("absent.pcap: cannot be opened"), std::string::npos);
    EXPECT_NE(error_of(folder.file("")).find("folder"), std::string::npos);
}

TEST(PcapSource, AnEmptyCaptureIsAnOutcome) {
    const ScratchFolder folder;
    PcapSource source(folder.write("empty.pcap", capture_file(FileKind::kMicrosecond, 1, {})));
    EXPECT_TRUE(read_all(source).empty());
    const auto warnings = source.take_warnings();
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find("empty.pcap: the capture has no packets"), std::string::npos);
}

TEST(PcapSource, CapturesOfFirstFragmentsOnlySaySo) {
    const ScratchFolder folder;
    std::vector<Record> all;
    for (std::uint32_t i = 0; i < 10; ++i) {
        const auto fragments = test::ip_fragments(test::udp(payload_pattern(8448, i)), {.id = i});
        all.push_back({kStart_ns + i * 1'000'000, test::link_frame(1, fragments[0])});
    }
    PcapSource source(folder.write("filtered.pcap", capture_file(FileKind::kMicrosecond, 1, all)));
    EXPECT_TRUE(read_all(source).empty());
    EXPECT_EQ(source.reassembly_counters().timed_out.value(), 10U);
    const auto warnings = source.take_warnings();
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find("filter on ports"), std::string::npos) << warnings[0];
}

TEST(PcapSource, WrongChecksumsOfWholeDatagramsAreDeliveredAndCounted) {
    const ScratchFolder folder;
    const auto ignored = [&](const std::vector<Checksum>& checksums) {
        std::vector<Record> all;
        std::uint32_t i = 0;
        for (const Checksum c : checksums) all.push_back({kStart_ns, lidar_frame(i++, c)});
        PcapSource source(folder.write("capture", capture_file(FileKind::kNanosecond, 1, all)));
        const auto got = read_all(source);
        EXPECT_EQ(got.size(), checksums.size());
        for (std::size_t k = 0; k < got.size(); ++k) {
            EXPECT_EQ(got[k].data, payload_pattern(1200, static_cast<std::uint32_t>(k)));
        }
        EXPECT_EQ(source.counters().checksum_wrong.value(), 0U);
        return source.counters().checksum_ignored.value();
    };
    using enum Checksum;
    EXPECT_EQ(ignored({kRight, kRight, kWrong, kRight}), 1U);
    EXPECT_EQ(ignored({kWrong, kWrong, kWrong}), 3U);  // addresses changed after the fact
    EXPECT_EQ(ignored({kOffloaded, kOffloaded}), 0U);
    EXPECT_EQ(ignored({kNone, kNone}), 0U);
}

TEST(PcapSource, OneIdForEveryDatagramCostsNoMoreThanTheOneWithALostFragmentAndTheNext) {
    const ScratchFolder folder;
    for (const Checksum checksum : {Checksum::kRight, Checksum::kNone}) {
        for (std::size_t lost = 0; lost < 3; ++lost) {
            std::vector<Record> all;
            std::set<std::string> sent;
            constexpr std::uint32_t kDatagrams = 20;
            for (std::uint32_t i = 0; i < kDatagrams; ++i) {
                sent.insert(test::key_of(payload_pattern(4000, i)));
                const auto fragments =
                    test::ip_fragments(test::udp(payload_pattern(4000, i), {.checksum = checksum}), {});
                ASSERT_EQ(fragments.size(), 3U);
                for (std::size_t k = 0; k < fragments.size(); ++k) {
                    if (i == 5 && k == lost) continue;
                    all.push_back({kStart_ns + i * 100'000'000, test::link_frame(1, fragments[k])});
                }
            }
            PcapSource source(folder.write("capture", capture_file(FileKind::kNanosecond, 1, all)));
            std::set<std::string> got;
            for (const Delivered& d : read_all(source)) got.insert(test::key_of(d.data));
            if (checksum == Checksum::kRight) {
                EXPECT_GE(got.size(), kDatagrams - 2) << lost;
                for (const std::string& key : got) EXPECT_TRUE(sent.contains(key)) << lost;
            } else if (lost > 0) {
                // Without a checksum all are refused for as long as they could be made of two: a second.
                EXPECT_EQ(got.size(), 5U + 3U) << lost;
                for (const std::string& key : got) EXPECT_TRUE(sent.contains(key)) << lost;
            }
        }
    }
}

TEST(PcapSource, ReassembledDatagramsMustPassTheirChecks) {
    const ScratchFolder folder;
    std::vector<Record> all;
    const auto add = [&](const std::vector<ByteVector>& packets) {
        for (const ByteVector& p : packets) all.push_back({kStart_ns, test::link_frame(1, p)});
    };
    // The halves of two datagrams that fit like one.
    const auto a = test::ip_fragments(test::udp(payload_pattern(2900, 1)), {.id = 1});
    const auto b = test::ip_fragments(test::udp(payload_pattern(2900, 2)), {.id = 1});
    add({a[0], b[1]});
    // The same with lengths that do not agree, and without checksums.
    const auto c = test::ip_fragments(test::udp(payload_pattern(2900, 3), {.checksum = Checksum::kNone}), {.id = 2});
    const auto d = test::ip_fragments(test::udp(payload_pattern(2800, 4), {.checksum = Checksum::kNone}), {.id = 2});
    add({c[0], d[1]});
    add(test::ip_fragments(test::udp(payload_pattern(2900, 5), {.checksum = Checksum::kNone}), {.id = 3}));
    PcapSource source(folder.write("capture", capture_file(FileKind::kNanosecond, 1, all)));
    const auto got = read_all(source);
    ASSERT_EQ(got.size(), 1U);
    EXPECT_EQ(got[0].data, payload_pattern(2900, 5));
    EXPECT_EQ(source.counters().checksum_wrong.value(), 1U);
    EXPECT_EQ(source.counters().malformed.value(), 1U);
}

TEST(PcapSource, StopsWhenAsked) {
    const ScratchFolder folder;
    PcapSource source(folder.write("capture", capture_file(FileKind::kNanosecond, 1, records(5))));
    EXPECT_EQ(source.next().status, SourceStatus::kPackets);
    source.stop();
    EXPECT_EQ(source.next().status, SourceStatus::kStopped);
}

TEST(PcapSource, DeliversRealCaptures) {
    struct Expected {
        std::size_t packets;
        std::size_t size;
    };
    const std::map<std::string, Expected> captures{{"OS-0-128-U1_v2.3.0_1024x10.pcap", {64, 8448}},
                                                   {"OS-0-32-U1_v2.2.0_1024x10.pcap", {64, 8448}},
                                                   {"OS-1-128_v2.3.0_1024x10_lb_n3.pcap", {192, 8448}},
                                                   {"OS-2-32-U0_v2.0.0_1024x10.pcap", {64, 6464}},
                                                   {"VLI-16-one-packet.pcap", {1, 1212}},
                                                   {"duplicate_id.pcap", {1, 8448}},
                                                   {"empty_pcap.pcap", {0, 0}},
                                                   {"windowed_frame1.pcap", {17, 8448}}};
    if (!test::data_path("ouster")) GTEST_SKIP() << "no data/ouster";
    for (const auto& [name, expected] : captures) {
        const auto path = test::data_path("ouster/" + name);
        ASSERT_TRUE(path) << name;
        PcapSource source(*path);
        std::size_t n = 0;
        for (const Delivered& d : read_all(source)) n += d.data.size() == expected.size ? 1 : 0;
        EXPECT_EQ(n, expected.packets) << name;
    }
}

/// Bytes changed, cut out and put in at random: whatever can be opened comes to its end, with every record accounted
/// for.
TEST(PcapSourceFuzz, DamagedCapturesEndCleanly) {
    const ScratchFolder folder;
    std::mt19937 random(7);
    const auto below = [&](std::size_t n) { return random() % n; };
    std::vector<Record> all;
    for (std::uint32_t i = 0; i < 12; ++i) {
        const bool ipv6 = i % 3 == 0;
        for (const ByteVector& p :
             test::ip_fragments(test::udp(payload_pattern(1600, i), {.ipv6 = ipv6}), {.ipv6 = ipv6, .id = i}, 400)) {
            all.push_back({kStart_ns + i * 1'000'000,
                           test::link_frame(1, p, i % 2 == 0 ? std::vector{3U} : std::vector<unsigned>{})});
        }
    }
    const int iterations = test::fuzz_packets(30'000) / static_cast<int>(all.size());
    int opened = 0;
    for (int i = 0; i < iterations; ++i) {
        const auto kind = static_cast<FileKind>(below(6));
        ByteVector bytes = capture_file(kind, 1, all);
        for (std::size_t changes = below(20); changes > 0; --changes) {
            // Headers more often than payload.
            const std::size_t at =
                below(3) == 0 ? below(std::min<std::size_t>(bytes.size(), 200)) : below(bytes.size());
            switch (below(4)) {
                case 0:
                    bytes[at] = static_cast<std::byte>(random());
                    break;
                case 1:
                    bytes[at] ^= static_cast<std::byte>(1U << below(8));
                    break;
                case 2:
                    bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                                bytes.begin() + static_cast<std::ptrdiff_t>(
                                                    std::min(bytes.size(), at + below(i % 2 == 0 ? 4 : 2000))));
                    break;
                default:
                    bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), below(40),
                                 static_cast<std::byte>(random()));
            }
            if (bytes.empty()) bytes.push_back(std::byte{});
        }
        const auto path = folder.write("fuzz", bytes);
        try {
            PcapSource source(path);
            ++opened;
            for (const Delivered& d : read_all(source)) EXPECT_LE(d.data.size(), 65'527U);
            const PcapCounters& c = source.counters();
            const ReassemblyCounters& r = source.reassembly_counters();
            const auto whole = c.delivered.value() + c.other_port.value() + c.not_ip.value() + c.not_udp.value() +
                               c.cut_short.value() + c.malformed.value() + c.checksum_wrong.value();
            EXPECT_EQ(whole + r.fragments.value() - r.reassembled.value(), c.records.value());
        } catch (const SourceError&) {
            continue;
        }
    }
    EXPECT_EQ(opened > 0, iterations > 0);
}

}  // namespace
}  // namespace dlod::driver
