#include "driver/udp_source.hpp"

#include <gtest/gtest.h>
#include <net/if.h>
#include <netinet/in.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace dlod::driver {
namespace {

/// Sends from a local address.
class Sender {
  public:
    explicit Sender(const std::string& from = "127.0.0.1") {
        const IpAddress address = *parse_address(from);
        family_ = is_ipv4(address) ? AF_INET : AF_INET6;
        fd_ = ::socket(family_, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        const SocketAddress local = to_socket_address({address, 0}, family_);
        usable_ = fd_ >= 0 && ::bind(fd_, local.get(), local.length) == 0;
    }
    ~Sender() { ::close(fd_); }
    Sender(const Sender&) = delete;
    Sender& operator=(const Sender&) = delete;

    bool usable() const { return usable_; }
    int fd() const { return fd_; }

    bool send(const std::string& to, std::uint16_t port, const std::vector<std::byte>& data) {
        const SocketAddress target = to_socket_address({*parse_address(to), port}, family_);
        return ::sendto(fd_, data.data(), data.size(), 0, target.get(), target.length) ==
               static_cast<ssize_t>(data.size());
    }

  private:
    int family_ = AF_INET;
    int fd_ = -1;
    bool usable_ = false;
};

std::vector<std::byte> pattern(std::size_t size, unsigned seed) {
    std::vector<std::byte> data(size);
    for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<std::byte>(i * 7 + seed);
    return data;
}

struct Received {
    std::vector<std::byte> data;
    Packet packet;
};

/// Until `count` packets are here or nothing came for a second.
std::vector<Received> receive(PacketSource& source, std::size_t count) {
    std::vector<Received> all;
    for (int idle = 0; all.size() < count && idle < 10;) {
        const PacketBatch batch = source.next();
        idle = batch.status == SourceStatus::kPackets ? 0 : idle + 1;
        for (const Packet& p : batch.packets) all.push_back({{p.data.begin(), p.data.end()}, p});
    }
    return all;
}

std::uint64_t counter(const PacketSource& source, std::string_view name) {
    std::uint64_t found = ~std::uint64_t{0};
    source.visit_counters([&](std::string_view n, std::uint64_t v) {
        if (n == name) found = v;
    });
    return found;
}

UdpOptions local(std::vector<std::uint16_t> ports = {0}) {
    UdpOptions options;
    options.ports = std::move(ports);
    options.bind_address = "127.0.0.1";
    return options;
}

std::string error_of(const UdpOptions& options) {
    try {
        UdpSource source(options);
    } catch (const SourceError& e) {
        return e.what();
    }
    return "";
}

std::int64_t now_ns() {
    return std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

TEST(UdpSource, ReceivesOnSeveralPortsWithStampsAndSenders) {
    UdpSource source(local({0, 0}));
    const auto ports = source.ports();
    ASSERT_EQ(ports.size(), 2U);
    ASSERT_NE(ports[0], ports[1]);

    Sender sender;
    const std::int64_t before = now_ns();
    constexpr unsigned kCount = 100;
    for (unsigned i = 0; i < kCount; ++i) {
        ASSERT_TRUE(sender.send("127.0.0.1", ports[0], pattern(8448, i)));
        if (i % 10 == 0) sender.send("127.0.0.1", ports[1], pattern(48, i));
    }
    const auto all = receive(source, kCount + kCount / 10);
    const std::int64_t after = now_ns();
    ASSERT_EQ(all.size(), kCount + kCount / 10);

    unsigned lidar = 0;
    unsigned imu = 0;
    for (const Received& r : all) {
        if (r.packet.destination_port == ports[0]) {
            EXPECT_EQ(r.data, pattern(8448, lidar++));
        } else {
            EXPECT_EQ(r.packet.destination_port, ports[1]);
            EXPECT_EQ(r.data, pattern(48, 10 * imu++));
        }
        EXPECT_EQ(to_string(r.packet.sender_address), "127.0.0.1");
        EXPECT_NE(r.packet.sender_port, 0);
        EXPECT_GE(r.packet.receive_ns, before - 1'000'000);
        EXPECT_LE(r.packet.receive_ns, after + 1'000'000);
    }
    EXPECT_EQ(counter(source, "packets_delivered"), all.size());
    EXPECT_EQ(counter(source, "packets_kernel_drops"), 0U);
}

TEST(UdpSource, KeepsOrderAcrossPortsWithinABatch) {
    UdpSource source(local({0, 0}));
    const auto ports = source.ports();
    Sender sender;
    // The kernel begins to stamp a moment after the first socket asks for it; before, packets are stamped when read.
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    for (unsigned i = 0; i < 20; ++i) sender.send("127.0.0.1", ports[i % 2], pattern(100, i));
    const auto all = receive(source, 20);
    ASSERT_EQ(all.size(), 20U);
    for (unsigned i = 0; i < 20; ++i) EXPECT_EQ(all[i].data, pattern(100, i)) << i;
}

TEST(UdpSource, DualStackTakesBothFamilies) {
    UdpOptions options;
    options.ports = {0};
    UdpSource source(options);
    Sender ipv6("::1");
    if (!ipv6.usable()) GTEST_SKIP() << "no IPv6 on the loopback interface";
    Sender ipv4;
    ASSERT_TRUE(ipv4.send("127.0.0.1", source.ports()[0], pattern(64, 4)));
    ASSERT_TRUE(ipv6.send("::1", source.ports()[0], pattern(64, 6)));
    const auto all = receive(source, 2);
    ASSERT_EQ(all.size(), 2U);
    EXPECT_EQ(to_string(all[0].packet.sender_address), "127.0.0.1");
    EXPECT_EQ(all[0].data, pattern(64, 4));
    EXPECT_EQ(to_string(all[1].packet.sender_address), "::1");
    EXPECT_EQ(all[1].data, pattern(64, 6));
}

TEST(UdpSource, Ipv6AddressBound) {
    Sender sender("::1");
    if (!sender.usable()) GTEST_SKIP() << "no IPv6 on the loopback interface";
    UdpOptions options = local();
    options.bind_address = "::1";
    options.senders = {"::1"};
    UdpSource source(options);
    ASSERT_TRUE(sender.send("::1", source.ports()[0], pattern(24832, 1)));
    const auto all = receive(source, 1);
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].data, pattern(24832, 1));
}

TEST(UdpSource, RefusesOtherSenders) {
    UdpOptions options = local();
    options.senders = {"127.0.0.2"};
    UdpSource source(options);
    Sender good("127.0.0.2");
    Sender bad("127.0.0.3");
    if (!good.usable() || !bad.usable()) GTEST_SKIP() << "only one loopback address";
    for (unsigned i = 0; i < 5; ++i) {
        bad.send("127.0.0.1", source.ports()[0], pattern(200, 99));
        good.send("127.0.0.1", source.ports()[0], pattern(100, i));
    }
    const auto all = receive(source, 5);
    ASSERT_EQ(all.size(), 5U);
    for (unsigned i = 0; i < 5; ++i) EXPECT_EQ(all[i].data, pattern(100, i));
    EXPECT_EQ(counter(source, "packets_refused_sender"), 5U);
}

TEST(UdpSource, CountsTruncatedDatagrams) {
    UdpOptions options = local();
    options.largest_datagram = 1000;
    UdpSource source(options);
    Sender sender;
    sender.send("127.0.0.1", source.ports()[0], pattern(1001, 1));
    sender.send("127.0.0.1", source.ports()[0], pattern(1000, 2));
    const auto all = receive(source, 1);
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].data, pattern(1000, 2));
    EXPECT_EQ(counter(source, "packets_truncated"), 1U);
}

TEST(UdpSource, KeepsOrderAcrossPortsAfterAStall) {
    UdpSource source(local({0, 0}));
    const auto ports = source.ports();
    Sender sender;
    constexpr unsigned kCount = 600;  // many batches, one port's packets six times as frequent
    for (unsigned i = 0; i < kCount; ++i) sender.send("127.0.0.1", ports[i % 7 == 6 ? 1 : 0], pattern(100, i));
    const auto all = receive(source, kCount);
    ASSERT_EQ(all.size(), kCount);
    for (unsigned i = 0; i < kCount; ++i) EXPECT_EQ(all[i].data, pattern(100, i)) << i;
}

TEST(UdpSource, CountsWhatTheKernelDrops) {
    UdpOptions options = local();
    options.receive_buffer_bytes = 1;  // already granted: stays as it is
    UdpSource source(options);
    Sender sender;
    constexpr unsigned kBurst = 5000;
    for (unsigned i = 0; i < kBurst; ++i) sender.send("127.0.0.1", source.ports()[0], pattern(8448, i));
    std::size_t n = receive(source, kBurst).size();
    // The kernel tells with the next packet.
    sender.send("127.0.0.1", source.ports()[0], pattern(8448, 0));
    n += receive(source, 1).size();
    EXPECT_GT(counter(source, "packets_kernel_drops"), 0U);
    EXPECT_EQ(n + counter(source, "packets_kernel_drops"), kBurst + 1);
}

TEST(UdpSource, SaysHowToAllowALargerBuffer) {
    UdpOptions options = local();
    options.receive_buffer_bytes = 1 << 30;  // half of what the kernel can count
    UdpSource source(options);
    const auto warnings = source.take_warnings();
    if (source.receive_buffer_bytes() >= options.receive_buffer_bytes) {
        EXPECT_TRUE(warnings.empty());
    } else {
        ASSERT_EQ(warnings.size(), 1U);
        EXPECT_NE(warnings[0].find("sysctl -w net.core.rmem_max=1073741824"), std::string::npos) << warnings[0];
    }
    EXPECT_TRUE(source.take_warnings().empty());
}

TEST(UdpSource, StopEndsTheWaitAtOnce) {
    UdpOptions options = local();
    options.timeout_ms = 60'000;
    UdpSource source(options);
    std::thread stopper([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        source.stop();
    });
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(source.next().status, SourceStatus::kStopped);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
    stopper.join();
    EXPECT_EQ(source.next().status, SourceStatus::kStopped);
}

TEST(UdpSource, IsIdleWithoutPackets) {
    UdpOptions options = local();
    options.timeout_ms = 1;
    UdpSource source(options);
    EXPECT_EQ(source.next().status, SourceStatus::kIdle);
}

TEST(UdpSource, ForwardsWhatItAccepts) {
    UdpSource second(local());
    UdpOptions options = local();
    options.forward_to = "127.0.0.1:" + std::to_string(second.ports()[0]);
    UdpSource first(options);
    Sender sender;
    for (unsigned i = 0; i < 10; ++i) sender.send("127.0.0.1", first.ports()[0], pattern(8448, i));
    ASSERT_EQ(receive(first, 10).size(), 10U);
    const auto copies = receive(second, 10);
    ASSERT_EQ(copies.size(), 10U);
    for (unsigned i = 0; i < 10; ++i) EXPECT_EQ(copies[i].data, pattern(8448, i));
    EXPECT_EQ(counter(first, "packets_forwarded"), 10U);
    EXPECT_EQ(counter(first, "packets_forward_failed"), 0U);
}

TEST(UdpSource, ForwardingFailuresAreCountedAndHarmless) {
    UdpOptions options = local();
    options.forward_to = "255.255.255.255:7502";  // broadcasts need an option that is not set
    UdpSource source(options);
    Sender sender;
    for (unsigned i = 0; i < 10; ++i) sender.send("127.0.0.1", source.ports()[0], pattern(100, i));
    EXPECT_EQ(receive(source, 10).size(), 10U);
    EXPECT_EQ(counter(source, "packets_forward_failed"), 10U);
}

TEST(UdpSource, RefusesToForwardToItself) {
    UdpSource probe(local());
    const std::uint16_t port = probe.ports()[0];
    UdpOptions options = local();
    options.forward_to = "127.0.0.1";
    EXPECT_NE(error_of(options).find("listens itself"), std::string::npos) << error_of(options);
    options.forward_to = "127.0.0.1:" + std::to_string(port);
    EXPECT_EQ(error_of(options), "");
}

/// Multicast on loopback where the host lets us.
class UdpMulticast : public testing::Test {
  protected:
    UdpOptions options(const std::string& group, std::uint16_t port) const {
        UdpOptions o;
        o.ports = {port};
        o.multicast_group = group;
        o.interface = "lo";
        o.share_ports = true;
        return o;
    }

    static void send_over_loopback(Sender& sender, const std::string& group, std::uint16_t port, unsigned seed) {
        const auto lo = ::if_nametoindex("lo");
        if (is_ipv4(*parse_address(group))) {
            const ip_mreqn interface { .imr_multiaddr = {}, .imr_address = {}, .imr_ifindex = static_cast<int>(lo) };
            ::setsockopt(sender.fd(), IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface);
            const int ttl = 0;
            ::setsockopt(sender.fd(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
        } else {
            ::setsockopt(sender.fd(), IPPROTO_IPV6, IPV6_MULTICAST_IF, &lo, sizeof lo);
            const int hops = 0;
            ::setsockopt(sender.fd(), IPPROTO_IPV6, IPV6_MULTICAST_HOPS, &hops, sizeof hops);
        }
        sender.send(group, port, pattern(8448, seed));
    }

    void two_readers(const std::string& group, const std::string& from) const {
        Sender sender(from);
        if (!sender.usable()) GTEST_SKIP() << "no " << from;
        UdpSource first(options(group, 0));
        UdpSource second(options(group, first.ports()[0]));
        for (unsigned i = 0; i < 5; ++i) send_over_loopback(sender, group, first.ports()[0], i);
        const auto a = receive(first, 5);
        if (a.empty()) GTEST_SKIP() << "no multicast over loopback here";
        const auto b = receive(second, 5);
        ASSERT_EQ(a.size(), 5U);
        ASSERT_EQ(b.size(), 5U);
        for (unsigned i = 0; i < 5; ++i) {
            EXPECT_EQ(a[i].data, pattern(8448, i));
            EXPECT_EQ(b[i].data, pattern(8448, i));
        }
    }
};

TEST_F(UdpMulticast, TwoReadersOfAnIpv4Group) {
    two_readers("239.255.76.68", "127.0.0.1");
}

TEST_F(UdpMulticast, TwoReadersOfAnIpv6Group) {
    two_readers("ff01::7668", "::1");
}

TEST_F(UdpMulticast, LeavesOtherGroupsAlone) {
    UdpSource ours(options("239.255.76.69", 0));
    UdpSource others(options("239.255.76.70", ours.ports()[0]));
    Sender sender;
    send_over_loopback(sender, "239.255.76.70", ours.ports()[0], 1);
    send_over_loopback(sender, "239.255.76.69", ours.ports()[0], 2);
    const auto all = receive(ours, 2);
    if (all.empty()) GTEST_SKIP() << "no multicast over loopback here";
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].data, pattern(8448, 2));
}

TEST(UdpSourceErrors, NameTheOptionAndWhatToDo) {
    const auto expect = [](const UdpOptions& options, const std::vector<std::string>& parts) {
        const std::string error = error_of(options);
        for (const std::string& part : parts)
            EXPECT_NE(error.find(part), std::string::npos) << part << " in: " << error;
    };
    UdpSource other(local());
    const std::string port = std::to_string(other.ports()[0]);
    expect(local({other.ports()[0]}), {port, "in use", "ss -ulpn"});
    expect(local({}), {"ports"});

    UdpOptions o = local();
    o.bind_address = "sensor.local";
    expect(o, {"bind_address", "sensor.local"});
    o = local();
    o.senders = {"10.0.0.300"};
    expect(o, {"senders", "10.0.0.300"});
    o = local();
    o.multicast_group = "10.0.0.1";
    expect(o, {"multicast_group", "10.0.0.1"});
    o = local();
    o.share_ports = true;
    expect(o, {"share_ports", "multicast_group", "forward_to"});
    o = local();
    o.forward_to = "10.0.0.1:port";
    expect(o, {"forward_to", "10.0.0.1:port"});
    o = UdpOptions{};
    o.ports = {0};
    o.multicast_group = "239.255.76.71";
    o.interface = "nosuch0";
    expect(o, {"interface", "nosuch0", "ip link"});
    o.interface = "";
    o.bind_address = "::1";
    expect(o, {"bind_address", "multicast_group", "::1"});
}

TEST(UdpSourceErrors, AnAddressThatIsNotThereYetIsAwaited) {
    UdpOptions o = local();
    o.bind_address = "203.0.113.77";  // of a block for documentation
    UdpSource source(o);
    const auto warnings = source.take_warnings();
    ASSERT_FALSE(warnings.empty());
    EXPECT_NE(warnings[0].find("203.0.113.77"), std::string::npos);
}

TEST(NetworkAddress, ParsesAndPrints) {
    for (const char* text : {"192.168.1.7", "0.0.0.0", "::1", "fe80::1", "2001:db8::5"}) {
        const auto address = parse_address(text);
        ASSERT_TRUE(address) << text;
        EXPECT_EQ(to_string(*address), text);
    }
    for (const char* text : {"", "1.2.3", "1.2.3.4.5", "fe80::1::2", "host", "1.2.3.4 "}) {
        EXPECT_FALSE(parse_address(text)) << text;
    }
    EXPECT_EQ(to_string(*parse_endpoint("10.1.2.3:7502")), "10.1.2.3:7502");
    EXPECT_EQ(to_string(*parse_endpoint("[2001:db8::5]:7502")), "[2001:db8::5]:7502");
    EXPECT_EQ(parse_endpoint("2001:db8::5")->port, 0);
    EXPECT_EQ(parse_endpoint("10.1.2.3")->port, 0);
    for (const char* text :
         {"10.1.2.3:", "10.1.2.3:0", "10.1.2.3:65536", "10.1.2.3:75x", "[::1", "[::1]7502", ":7502"}) {
        EXPECT_FALSE(parse_endpoint(text)) << text;
    }
    EXPECT_TRUE(is_multicast(*parse_address("239.1.2.3")));
    EXPECT_TRUE(is_multicast(*parse_address("ff02::1")));
    EXPECT_FALSE(is_multicast(*parse_address("223.255.255.255")));
    EXPECT_TRUE(is_unspecified(*parse_address("0.0.0.0")));
    EXPECT_TRUE(is_unspecified(*parse_address("::")));
}

}  // namespace
}  // namespace dlod::driver
