// What the running program can be reached by.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "tests/daemon/live/live_run.hpp"
#include "tests/support/fake_sensor.hpp"

namespace dlod {
namespace {

/// Inodes of a process's sockets.
std::set<std::string> sockets_of(pid_t pid) {
    std::set<std::string> inodes;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd")) {
        std::error_code ignored;
        const std::string target = std::filesystem::read_symlink(entry.path(), ignored).string();
        if (target.starts_with("socket:[")) inodes.insert(target.substr(8, target.size() - 9));
    }
    return inodes;
}

struct BoundSocket {
    unsigned port = 0;
    std::string state;  ///< as the kernel writes it: 0A is a TCP socket that listens
};

/// The process's sockets in one of the tables in /proc/PID/net: udp, udp6, tcp, tcp6.
std::vector<BoundSocket> bound_sockets(pid_t pid, const std::string& table) {
    const auto inodes = sockets_of(pid);
    std::vector<BoundSocket> sockets;
    std::ifstream file("/proc/" + std::to_string(pid) + "/net/" + table);
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
        std::istringstream words(line);
        std::string number, local, remote, state, queues, timer, retransmitted, user, timeout, inode;
        words >> number >> local >> remote >> state >> queues >> timer >> retransmitted >> user >> timeout >> inode;
        if (!inodes.contains(inode)) continue;
        sockets.push_back({static_cast<unsigned>(std::stoul(local.substr(local.find(':') + 1), nullptr, 16)), state});
    }
    return sockets;
}

TEST(OpenPorts, NothingListensButTheSensorsPortsAndLcm) {
    test::LiveRun run;
    if (!run.usable()) GTEST_SKIP() << "no multicast here";
    test::FakeSensor sensor(test::on_live_ports());
    run.write_config("host: \"" + sensor.host() + "\"");
    run.start();
    ASSERT_TRUE(run.poses_flow());
    const pid_t pid = run.daemon->pid();
    unsigned first_ephemeral = 0;
    std::ifstream("/proc/sys/net/ipv4/ip_local_port_range") >> first_ephemeral;
    std::set<unsigned> fixed;
    for (const char* table : {"udp", "udp6"}) {
        for (const auto& socket : bound_sockets(pid, table)) {
            // What is sent by has a port of the kernel's choice, by which nobody reads.
            if (socket.port < first_ephemeral) fixed.insert(socket.port);
        }
    }
    EXPECT_EQ(fixed, (std::set<unsigned>{test::kLiveLidarPort, test::kLiveImuPort, test::kLiveLcmPort}));
    for (const char* table : {"tcp", "tcp6"}) {
        for (const auto& socket : bound_sockets(pid, table)) EXPECT_NE(socket.state, "0A") << "port " << socket.port;
    }
    run.stop();
}

}  // namespace
}  // namespace dlod
