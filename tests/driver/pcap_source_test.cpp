#include "driver/pcap_source.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "driver/pcap_writer.hpp"
#include "tests/support/test_data.hpp"

namespace dlod::driver {
namespace {

struct Delivered {
    std::vector<std::byte> data;
    std::int64_t receive_ns = 0;
    std::uint16_t port = 0;
};

std::vector<Delivered> read_all(PcapSource& source) {
    std::vector<Delivered> all;
    for (;;) {
        const PacketBatch batch = source.next();
        if (batch.status != SourceStatus::kPackets) {
            EXPECT_EQ(batch.status, SourceStatus::kEnd);
            return all;
        }
        for (const Packet& p : batch.packets) {
            all.push_back({{p.data.begin(), p.data.end()}, p.receive_ns, p.destination_port});
        }
    }
}

TEST(PcapSource, DeliversRealCaptures) {
    struct Expected {
        std::size_t packets;
        std::size_t size;  // of most
    };
    const std::map<std::string, Expected> captures{{"OS-0-128-U1_v2.3.0_1024x10.pcap", {64, 8448}},
                                                   {"OS-0-32-U1_v2.2.0_1024x10.pcap", {64, 8448}},
                                                   {"OS-1-128_v2.3.0_1024x10_lb_n3.pcap", {192, 8448}},
                                                   {"OS-2-32-U0_v2.0.0_1024x10.pcap", {64, 6464}},
                                                   {"VLI-16-one-packet.pcap", {1, 1212}},
                                                   {"duplicate_id.pcap", {1, 8448}},
                                                   {"empty_pcap.pcap", {0, 0}},
                                                   {"windowed_frame1.pcap", {17, 8448}}};
    for (const auto& [name, expected] : captures) {
        const auto path = test::data_path("ouster/" + name);
        if (!path) GTEST_SKIP() << "no data/ouster/" << name;
        PcapSource source(*path);
        std::size_t n = 0;
        for (const Delivered& d : read_all(source)) n += d.data.size() == expected.size ? 1 : 0;
        EXPECT_EQ(n, expected.packets) << name;
    }
}

}  // namespace
}  // namespace dlod::driver
