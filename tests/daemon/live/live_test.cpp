// The whole program, live: packets over UDP, messages over LCM's multicast, counted by a real subscriber.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <dlod/dynamic_mask_t.hpp>
#include <dlod/pose_t.hpp>
#include <dlod/status_t.hpp>
#include <dlod/tracks_t.hpp>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>
#include <thread>

#include "tests/support/child_process.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;

constexpr int kFrames = 40;
/// A port of its own: LCM hears every multicast group on its port.
constexpr const char* kUrl = "udpm://239.255.76.99:17667?ttl=0";

/// Counts what planners would see.
class Subscriber {
  public:
    Subscriber() : lcm_(kUrl) {
        if (!lcm_.good()) return;
        lcm_.subscribe("TEST_POSE", &Subscriber::on_pose, this);
        lcm_.subscribe("TEST_MASK", &Subscriber::on_mask, this);
        lcm_.subscribe("TEST_TRACKS", &Subscriber::on_tracks, this);
        lcm_.subscribe("TEST_STATUS", &Subscriber::on_status, this);
        thread_ = std::thread([this] {
            while (!stop_) lcm_.handleTimeout(50);
        });
    }
    ~Subscriber() { stop(); }
    void stop() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
    }
    bool good() const { return lcm_.good(); }

    // To be read after stop().
    std::map<std::int64_t, pose_t> poses;
    std::map<std::int64_t, std::int64_t> mask_utimes;
    std::map<std::int64_t, std::int64_t> track_utimes;
    std::vector<status_t> statuses;

  private:
    void on_pose(const lcm::ReceiveBuffer*, const std::string&, const pose_t* m) { poses[m->sequence] = *m; }
    void on_mask(const lcm::ReceiveBuffer*, const std::string&, const dynamic_mask_t* m) {
        mask_utimes[m->sequence] = m->utime;
    }
    void on_tracks(const lcm::ReceiveBuffer*, const std::string&, const tracks_t* m) {
        track_utimes[m->sequence] = m->utime;
    }
    void on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* m) { statuses.push_back(*m); }

    lcm::LCM lcm_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// Stands in for systemd: collects what the service tells.
class NotifySocket {
  public:
    explicit NotifySocket(const std::filesystem::path& folder) : path_((folder / "notify").string()) {
        socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
        if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
            ADD_FAILURE() << "bind " << path_;
    }
    ~NotifySocket() { ::close(socket_); }
    const std::string& path() const { return path_; }
    const std::string& messages() {
        char buffer[2048];
        for (ssize_t n = 0; (n = ::recv(socket_, buffer, sizeof(buffer), MSG_DONTWAIT)) > 0;) {
            messages_.append(buffer, static_cast<std::size_t>(n)) += '\n';
        }
        return messages_;
    }
    bool wait_for(const std::string& text, std::chrono::milliseconds timeout) {
        const auto deadline = std::chrono::steady_clock::now() + timeout;
        while (messages().find(text) == std::string::npos) {
            if (std::chrono::steady_clock::now() > deadline) return false;
            pollfd watched{socket_, POLLIN, 0};
            ::poll(&watched, 1, 20);
        }
        return true;
    }

  private:
    std::string path_;
    int socket_;
    std::string messages_;
};

/// Sends the drive's packets to loopback, each when it is due.
void send_at_true_rate(const test::SyntheticCapture& capture) {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ASSERT_GE(socket, 0);
    const auto start = std::chrono::steady_clock::now();
    for (const auto& packet : capture.packets()) {
        std::this_thread::sleep_until(start +
                                      std::chrono::nanoseconds(packet.time_ns - capture.packets().front().time_ns));
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(packet.port);
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        ASSERT_EQ(::sendto(socket, packet.data.data(), packet.data.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                           sizeof(to)),
                  static_cast<ssize_t>(packet.data.size()));
    }
    ::close(socket);
}

TEST(Live, NoFrameIsLostFromPacketToSubscriber) {
    const test::TemporaryFolder folder;
    if (!test::enter_network_namespace()) GTEST_LOG_(INFO) << "no namespace of its own: on the host's loopback";
    Subscriber subscriber;
    if (!subscriber.good()) GTEST_SKIP() << "no multicast here";
    NotifySocket systemd(folder.path());
    const test::SyntheticCapture capture(kFrames);
    std::ofstream(folder.path() / "sensor.json") << test::SyntheticCapture::metadata();
    std::ofstream(folder.path() / "dlod.yaml")
        << "sensor: {metadata: " << (folder.path() / "sensor.json").string() << "}\n"
        << "lcm: {channel_prefix: TEST_, url: \"" << kUrl << "\"}\n";
    test::ChildProcess daemon(
        {DLOD_BINARY, "run", "-c", (folder.path() / "dlod.yaml").string(), "--out", (folder.path() / "out").string()},
        {.environment = {"NOTIFY_SOCKET=" + systemd.path()}, .largest_file = {}});
    ASSERT_TRUE(systemd.wait_for("READY=1", 10s)) << daemon.output();

    const auto wall_start = std::chrono::system_clock::now();
    send_at_true_rate(capture);
    std::this_thread::sleep_for(500ms);
    EXPECT_TRUE(systemd.wait_for("WATCHDOG=1", 2s)) << "the watchdog is fed while frames flow";
    daemon.signal(SIGHUP);
    EXPECT_TRUE(systemd.wait_for("RELOADING=1", 2s));
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(2s), 0) << "a clean stop within two seconds\n" << daemon.output();
    EXPECT_TRUE(systemd.wait_for("STOPPING=1", 1s));
    subscriber.stop();

    ASSERT_EQ(subscriber.poses.size(), static_cast<std::size_t>(kFrames)) << daemon.output();
    EXPECT_EQ(subscriber.mask_utimes.size(), static_cast<std::size_t>(kFrames));
    EXPECT_EQ(subscriber.track_utimes.size(), static_cast<std::size_t>(kFrames));
    const std::int64_t begin =
        std::chrono::duration_cast<std::chrono::microseconds>(wall_start.time_since_epoch()).count();
    std::int64_t last_utime = 0;
    for (const auto& [sequence, pose] : subscriber.poses) {
        EXPECT_EQ(subscriber.mask_utimes.at(sequence), pose.utime);
        EXPECT_EQ(subscriber.track_utimes.at(sequence), pose.utime);
        EXPECT_GT(pose.utime, last_utime);
        last_utime = pose.utime;
        // The sensor's clock has nothing to do with the host's: utime is host time all the same.
        EXPECT_NEAR(1e-6 * static_cast<double>(pose.utime - begin), 0.1 * static_cast<double>(sequence + 1), 0.09);
    }
    EXPECT_NE(subscriber.poses.rbegin()->second.flags & pose_t::VALID, 0);

    ASSERT_GE(subscriber.statuses.size(), 3U);
    const auto& status = subscriber.statuses.back();
    EXPECT_NEAR(subscriber.statuses[2].frame_rate, 10.0, 2.5);
    EXPECT_NE(status.sensor.find("123456"), std::string::npos);
    EXPECT_GT(status.memory, 0);
    std::map<std::string, std::int64_t> counters;
    for (std::size_t i = 0; i < status.counter_name.size(); ++i)
        counters[status.counter_name[i]] = status.counter_value[i];
    EXPECT_EQ(counters.at("frames"), kFrames);
    EXPECT_EQ(counters.at("pipeline_dropped_frames"), 0);
    EXPECT_EQ(counters.at("lcm_failed"), 0);
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "out" / "map.pcd")) << "all outputs are complete";
}

}  // namespace
}  // namespace dlod
