#include "driver/pcap_writer.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <vector>

#include "driver/network_address.hpp"
#include "driver/pcap_source.hpp"
#include "tests/support/network_bytes.hpp"

namespace dlod::driver {
namespace {

using test::ByteVector;
using test::payload_pattern;
using test::ScratchFolder;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'001;

Packet packet(const ByteVector& data, const char* sender, std::int64_t time_ns) {
    return {.data = data,
            .receive_ns = time_ns,
            .sender_address = *parse_address(sender),
            .sender_port = 40'000,
            .destination_port = 7502};
}

TEST(PcapWriter, WhatItWritesIsReadBack) {
    const ScratchFolder folder;
    const std::vector<std::size_t> sizes{0, 1, 48, 1472, 1473, 8448, 24832, 33024, 65507};
    for (const char* sender : {"192.168.1.50", "fd00::50"}) {
        for (const int mtu : {65535, 1500, 576, 0}) {
            const auto path = folder.file("written.pcap");
            const bool ipv6 = !is_ipv4(*parse_address(sender));
            {
                PcapWriter writer(path, {.mtu = mtu});
                for (std::size_t i = 0; i < sizes.size(); ++i) {
                    const ByteVector data = payload_pattern(sizes[i], 3);
                    EXPECT_TRUE(writer.write(packet(data, sender, kStart_ns + static_cast<std::int64_t>(i))));
                }
                EXPECT_TRUE(writer.flush());
                EXPECT_EQ(writer.size(), std::filesystem::file_size(path));
            }
            PcapSource source(path);
            for (std::size_t i = 0; i < sizes.size(); ++i) {
                const PacketBatch batch = source.next();
                ASSERT_EQ(batch.status, SourceStatus::kPackets) << "mtu " << mtu << ", size " << sizes[i];
                const Packet& p = batch.packets[0];
                EXPECT_EQ(ByteVector(p.data.begin(), p.data.end()), payload_pattern(sizes[i], 3));
                EXPECT_EQ(p.receive_ns, kStart_ns + static_cast<std::int64_t>(i));
                EXPECT_EQ(to_string(p.sender_address), sender);
                EXPECT_EQ(p.sender_port, 40'000);
                EXPECT_EQ(p.destination_port, 7502);
            }
            EXPECT_EQ(source.next().status, SourceStatus::kEnd);
            EXPECT_EQ(source.reassembly_counters().fragments.value() > 0, mtu < 65535 || ipv6);
            EXPECT_EQ(source.counters().checksum_ignored.value(), 0U);
        }
    }
}

TEST(PcapWriter, RefusesWhatIsNoDatagram) {
    const ScratchFolder folder;
    PcapWriter writer(folder.file("large.pcap"));
    EXPECT_FALSE(writer.write(packet(payload_pattern(65508, 1), "10.0.0.1", kStart_ns)));
    EXPECT_TRUE(writer.ok());
    EXPECT_EQ(writer.size(), 24U);
}

TEST(PcapWriter, SaysWhatItCannotCreate) {
    PcapWriter writer("/nonexistent/folder/x.pcap");
    EXPECT_FALSE(writer.ok());
    EXPECT_NE(writer.error().find("/nonexistent/folder/x.pcap: cannot be created"), std::string::npos);
    EXPECT_FALSE(writer.write(packet(payload_pattern(48, 1), "10.0.0.1", kStart_ns)));
    EXPECT_FALSE(writer.flush());
}

TEST(PcapWriter, ReportsAFullDisk) {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
    PcapWriter writer("/dev/full");
    EXPECT_TRUE(writer.write(packet(payload_pattern(48, 1), "10.0.0.1", kStart_ns)));
    EXPECT_FALSE(writer.flush());
    EXPECT_NE(writer.error().find("No space left"), std::string::npos) << writer.error();
    EXPECT_FALSE(writer.write(packet(payload_pattern(48, 1), "10.0.0.1", kStart_ns)));
}

TEST(PcapWriter, TheFileEndsWithAWholeRecordWhereSpaceEnds) {
    const ScratchFolder folder;
    const auto path = folder.file("limited.pcap");
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limited{.rlim_cur = 100'000, .rlim_max = before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limited), 0);
    int written = 0;
    std::string error;
    {
        PcapWriter writer(path);
        const ByteVector data = payload_pattern(8448, 1);
        while (writer.write(packet(data, "10.0.0.1", kStart_ns)) && writer.flush()) ++written;
        error = writer.error();
    }
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_EQ(written, 11);
    EXPECT_NE(error.find("limited.pcap: cannot be written"), std::string::npos) << error;
    PcapSource source(path);
    int read = 0;
    while (source.next().status == SourceStatus::kPackets) ++read;
    EXPECT_EQ(read, written);
    EXPECT_TRUE(source.take_warnings().empty());
}

}  // namespace
}  // namespace dlod::driver
