#include "driver/port_selection.hpp"

#include <gtest/gtest.h>

#include "driver/pcap_source.hpp"
#include "tests/support/network_bytes.hpp"
#include "tests/support/test_data.hpp"

namespace dlod::driver {
namespace {

using test::ByteVector;
using test::payload_pattern;
using test::ScratchFolder;

constexpr ExpectedPackets kExpected{.lidar_port = 7502, .imu_port = 7503, .lidar_bytes = 8448, .imu_bytes = 48};

struct Sent {
    std::uint16_t port;
    std::size_t bytes;
    int count = 1;
};

PortSelection select(const std::vector<Sent>& sent) {
    const ScratchFolder folder;
    std::vector<test::Record> records;
    std::int64_t time_ns = 1'700'000'000'000'000'000;
    for (const Sent& s : sent) {
        for (int i = 0; i < s.count; ++i) {
            const ByteVector frame =
                test::link_frame(1, test::ip(test::udp(payload_pattern(s.bytes, 1), {.port = s.port})));
            records.push_back({time_ns += 1'000'000, frame});
        }
    }
    return select_ports(folder.write("c.pcap", capture_file(test::FileKind::kNanosecond, 1, records)), kExpected);
}

TEST(PortSelection, TheMetadatasPortsHold) {
    const auto s = select({{9000, 8448, 5}, {9001, 48}, {7503, 48}, {7502, 8448}});
    EXPECT_EQ(s.lidar_port, 7502);
    EXPECT_EQ(s.imu_port, 7503);
    EXPECT_TRUE(s.lidar_found);
    EXPECT_TRUE(s.imu_found);
    EXPECT_TRUE(s.warnings.empty());
}

TEST(PortSelection, OtherPortsAreFoundBySize) {
    const auto s = select({{53, 60, 20}, {7502, 1212, 3}, {9100, 8448, 2}, {9200, 8448, 5}, {9201, 48, 5}});
    EXPECT_EQ(s.lidar_port, 9200);
    EXPECT_EQ(s.imu_port, 9201);
    EXPECT_TRUE(s.lidar_found);
    ASSERT_EQ(s.warnings.size(), 2U);
    EXPECT_NE(s.warnings[0].find("port 7502"), std::string::npos);
    EXPECT_NE(s.warnings[0].find("port 9200"), std::string::npos);
}

TEST(PortSelection, NothingFittingIsSaid) {
    const auto s = select({{2368, 1206, 3}});
    EXPECT_FALSE(s.lidar_found);
    EXPECT_EQ(s.lidar_port, 7502);
    ASSERT_EQ(s.warnings.size(), 1U);
    EXPECT_NE(s.warnings[0].find("3 of 1206 bytes to port 2368"), std::string::npos) << s.warnings[0];
    // An empty capture says nothing about the metadata.
    EXPECT_TRUE(select({}).warnings.empty());
}

TEST(PortSelection, LooksNoFurtherThanTwoSeconds) {
    // The metadata's port comes too late to count.
    const auto s = select({{9200, 8448, 2500}, {7502, 8448, 5}});
    EXPECT_EQ(s.lidar_port, 9200);
}

TEST(PortSelection, RealCaptureWithPortsOfItsOwn) {
    const auto path = test::data_path("ouster/windowed_frame1.pcap");
    if (!path) GTEST_SKIP() << "no data/ouster";
    const auto s = select_ports(*path, kExpected);
    EXPECT_EQ(s.lidar_port, 53750);
    EXPECT_EQ(s.imu_port, 7503);
}

}  // namespace
}  // namespace dlod::driver
