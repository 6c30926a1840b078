// An operator's and a planner's view of a live run: commands with their answers, and the optional messages.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bot_core/pose_t.hpp>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <dlod/command_t.hpp>
#include <dlod/obstacles_t.hpp>
#include <dlod/pose_t.hpp>
#include <dlod/sensor_t.hpp>
#include <dlod/status_t.hpp>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tests/support/child_process.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;

/// A port of its own: LCM hears every multicast group on its port.
constexpr const char* kUrl = "udpm://239.255.76.97:17669?ttl=0";

/// Under a sanitizer all takes longer: the drive is sent slower and cut short, answers are waited for.
constexpr bool kSmall = test::kTooSlowForTimes;
constexpr int kSlower = kSmall ? 10 : 1;
constexpr int kFrames = kSmall ? 40 : 80;
constexpr std::size_t kFramesBefore = kSmall ? 15 : 25;  ///< the first command

int loopback_socket(std::uint16_t port) {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) ADD_FAILURE() << "bind";
    return socket;
}

std::uint16_t port_of(int socket) {
    sockaddr_in address{};
    socklen_t size = sizeof(address);
    ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
}

/// Sends commands and waits for what is said about them.
class Operator {
  public:
    Operator() : lcm_(kUrl) {
        if (!lcm_.good()) return;
        lcm_.subscribe("TEST_STATUS", &Operator::on_status, this);
        lcm_.subscribe("TEST_POSE", &Operator::on_pose, this);
        lcm_.subscribe("TEST_SENSOR", &Operator::on_sensor, this);
        lcm_.subscribe("TEST_OBSTACLES", &Operator::on_obstacles, this);
        lcm_.subscribe("POSE", &Operator::on_bot_core_pose, this);
        thread_ = std::thread([this] {
            while (!stop_) lcm_.handleTimeout(50);
        });
    }
    ~Operator() { stop(); }
    void stop() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
    }
    bool good() const { return lcm_.good(); }

    void send(std::int64_t id, std::int8_t command, const std::string& argument) {
        command_.emplace();
        command_->utime = id;
        command_->id = id;
        command_->command = command;
        command_->argument = argument;
        lcm_.publish("TEST_COMMAND", &*command_);
    }
    void send_garbage() {
        lcm_.publish("TEST_COMMAND", "garbage", 7);
        pose_t foreign{};
        lcm_.publish("TEST_COMMAND", &foreign);
    }
    /// The first status with the answer to that command. The command sent last goes out again until it is answered, as
    /// operators' do: who listens may not have been ready for it.
    std::optional<status_t> answer_to(std::int64_t id, std::chrono::milliseconds timeout = kSmall ? 60s : 3s) {
        const auto deadline = std::chrono::steady_clock::now() + timeout;
        std::unique_lock lock(mutex_);
        while (!changed_.wait_for(lock, 500ms, [&] { return answers_.count(id) > 0; }) &&
               std::chrono::steady_clock::now() < deadline) {
            if (command_ && command_->id == id) lcm_.publish("TEST_COMMAND", &*command_);
        }
        const auto found = answers_.find(id);
        return found == answers_.end() ? std::nullopt : std::optional(found->second);
    }
    bool wait_for_pose(std::size_t count, std::chrono::milliseconds timeout) {
        std::unique_lock lock(mutex_);
        return changed_.wait_for(lock, timeout, [&] { return poses.size() >= count; });
    }

    // To be read after stop().
    std::vector<pose_t> poses;
    std::vector<bot_core::pose_t> bot_core_poses;
    std::vector<sensor_t> sensors;
    std::vector<obstacles_t> obstacles;
    status_t last_status{};

  private:
    template <class F>
    void note(F&& change) {
        const std::lock_guard lock(mutex_);
        change();
        changed_.notify_all();
    }
    void on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* m) {
        note([&] {
            last_status = *m;
            answers_.try_emplace(m->command_id, *m);
        });
    }
    void on_pose(const lcm::ReceiveBuffer*, const std::string&, const pose_t* m) {
        note([&] { poses.push_back(*m); });
    }
    void on_bot_core_pose(const lcm::ReceiveBuffer*, const std::string&, const bot_core::pose_t* m) {
        note([&] { bot_core_poses.push_back(*m); });
    }
    void on_sensor(const lcm::ReceiveBuffer*, const std::string&, const sensor_t* m) {
        note([&] { sensors.push_back(*m); });
    }
    void on_obstacles(const lcm::ReceiveBuffer*, const std::string&, const obstacles_t* m) {
        note([&] { obstacles.push_back(*m); });
    }

    lcm::LCM lcm_;
    std::optional<command_t> command_;  ///< sent last
    std::mutex mutex_;
    std::condition_variable changed_;
    std::map<std::int64_t, status_t> answers_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// Sends a drive's packets to loopback at true rate, or slower, until it is destroyed or the drive ends.
class Sensor {
  public:
    explicit Sensor(const test::SyntheticCapture& capture)
        : thread_([this, &capture] {
              const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
              const auto start = std::chrono::steady_clock::now();
              const auto first_ns = capture.packets().front().time_ns;
              for (const auto& packet : capture.packets()) {
                  std::this_thread::sleep_until(start + kSlower * std::chrono::nanoseconds(packet.time_ns - first_ns));
                  if (stop_) break;
                  sockaddr_in to{};
                  to.sin_family = AF_INET;
                  to.sin_port = htons(packet.port);
                  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
                  if (::sendto(socket, packet.data.data(), packet.data.size(), 0,
                               reinterpret_cast<const sockaddr*>(&to), sizeof(to)) > 0) {
                      ++sent_;
                  }
              }
              ::close(socket);
          }) {}
    ~Sensor() { stop(); }
    std::size_t stop() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
        return sent_;
    }

  private:
    std::atomic<bool> stop_{false};
    std::atomic<std::size_t> sent_{0};
    std::thread thread_;
};

std::map<std::string, std::int64_t> counters_of(const status_t& status) {
    std::map<std::string, std::int64_t> counters;
    for (std::size_t i = 0; i < status.counter_name.size(); ++i)
        counters[status.counter_name[i]] = status.counter_value[i];
    return counters;
}

TEST(RemoteControl, ALiveRunDoesWhatItIsToldAndTellsWhatPlannersNeed) {
    const test::TemporaryFolder folder;
    if (!test::enter_network_namespace()) GTEST_LOG_(INFO) << "no namespace of its own: on the host's loopback";
    Operator op;
    if (!op.good()) GTEST_SKIP() << "no multicast here";
    const int second_reader = loopback_socket(0);
    const auto maps = folder.path() / "maps";
    std::ofstream(folder.path() / "sensor.json") << test::SyntheticCapture::metadata();
    std::ofstream(folder.path() / "dlod.yaml")
        << "sensor: {metadata: " << (folder.path() / "sensor.json").string()
        << ", forward_to: \"127.0.0.1:" << port_of(second_reader) << "\"}\n"
        << "lcm: {channel_prefix: TEST_, url: \"" << kUrl << "\", bot_core_channel: POSE,\n"
        << "      obstacles: {every_frames: 2, radius_m: 30}}\n"
        << "saved_maps: {folder: " << maps.string() << ", at_stop: true}\n";
    const test::SyntheticCapture capture(kFrames);
    test::ChildProcess daemon({DLOD_BINARY, "run", "-c", (folder.path() / "dlod.yaml").string()});
    ASSERT_TRUE(op.answer_to(0, kSlower * 20s)) << "no status\n" << daemon.output();

    // Without a sensor.
    op.send(5, command_t::RESTART_ODOMETRY, "");
    const auto early = op.answer_to(5);
    ASSERT_TRUE(early) << daemon.output();
    EXPECT_NE(early->command_answer.find("no frames come"), std::string::npos) << early->command_answer;

    Sensor sensor(capture);
    ASSERT_TRUE(op.wait_for_pose(kFramesBefore, kSlower * 10s)) << daemon.output();
    op.send(10, command_t::SAVE_MAP, "hall");
    const auto saved = op.answer_to(10);
    ASSERT_TRUE(saved) << daemon.output();
    EXPECT_TRUE(saved->command_ok) << saved->command_answer;
    EXPECT_GT(std::filesystem::file_size(maps / "hall.pcd"), 5000U);
    EXPECT_GT(std::filesystem::file_size(maps / "hall.ply"), 5000U);
    EXPECT_GT(saved->frame_rate, 0.0) << "the rest of the status is there, too";

    for (const char* name : {"../escaped", "/etc/escaped", "..", "a/b"}) {
        static std::int64_t id = 20;
        op.send(++id, command_t::SAVE_MAP, name);
        const auto refused = op.answer_to(id);
        ASSERT_TRUE(refused) << name;
        EXPECT_FALSE(refused->command_ok) << name;
    }
    std::filesystem::create_directory(maps / "taken.pcd");  // cannot be replaced by a file
    op.send(30, command_t::SAVE_MAP, "taken");
    const auto unwritable = op.answer_to(30);
    ASSERT_TRUE(unwritable);
    EXPECT_FALSE(unwritable->command_ok);
    EXPECT_NE(unwritable->command_answer.find("taken.pcd"), std::string::npos) << unwritable->command_answer;

    op.send_garbage();
    op.send(40, 99, "");
    const auto unknown = op.answer_to(40);
    ASSERT_TRUE(unknown);
    EXPECT_FALSE(unknown->command_ok);
    op.send(41, command_t::SET_LOG_LEVEL, "debug");
    ASSERT_TRUE(op.answer_to(41));
    EXPECT_TRUE(op.answer_to(41)->command_ok);

    op.send(50, command_t::RESTART_ODOMETRY, "");
    const auto restarted = op.answer_to(50);
    ASSERT_TRUE(restarted);
    EXPECT_TRUE(restarted->command_ok);
    EXPECT_NE(restarted->command_answer.find("anew"), std::string::npos) << restarted->command_answer;
    std::this_thread::sleep_for(kSlower * 1200ms);
    const std::size_t sent = sensor.stop();
    daemon.signal(SIGTERM);
    EXPECT_EQ(daemon.wait(kSlower * 2s), 0) << daemon.output();
    op.stop();

    std::vector<std::size_t> starts;
    for (std::size_t i = 0; i < op.poses.size(); ++i) {
        if ((op.poses[i].flags & pose_t::RESTARTED) != 0) starts.push_back(i);
    }
    ASSERT_EQ(starts.size(), 2U) << "the first pose, and that after the command";
    EXPECT_EQ(starts[0], 0U);
    const auto& last_before = op.poses[starts[1] - 1];
    const auto& first_after = op.poses[starts[1]];
    EXPECT_GT(last_before.position[0], 0.08 * kFramesBefore);
    EXPECT_LT(std::abs(first_after.position[0]), 0.2) << "the origin is where the robot is now";
    EXPECT_EQ(first_after.sequence, last_before.sequence + 1) << "no frame was lost over it";
    EXPECT_NE(op.poses.back().flags & pose_t::VALID, 0);

    ASSERT_GE(op.sensors.size(), 1U);
    EXPECT_EQ(op.sensors[0].serial_number, "123456");
    EXPECT_EQ(op.sensors[0].rows, test::SyntheticCapture::kRows);
    ASSERT_GE(op.obstacles.size(), kSmall ? 6U : 15U);
    EXPECT_GT(op.obstacles[4].count, 300);   // the last one is of what had arrived of a frame at the stop
    std::int64_t smallest_step = INT64_MAX;  // a busy machine drops frames, which makes larger ones
    for (std::size_t i = 1; i < op.obstacles.size(); ++i)
        smallest_step = std::min(smallest_step, op.obstacles[i].sequence - op.obstacles[i - 1].sequence);
    EXPECT_EQ(smallest_step, 2);
    ASSERT_GE(op.bot_core_poses.size(), kFramesBefore + 5);
    EXPECT_EQ(op.bot_core_poses.back().utime, op.poses.back().utime);
    EXPECT_EQ(op.bot_core_poses.back().pos[0], op.poses.back().position[0]);

    const auto counters = counters_of(op.last_status);
    EXPECT_EQ(counters.at("commands_ignored"), 2);
    EXPECT_EQ(counters.at("commands"), 10);
    EXPECT_EQ(counters.at("lcm_failed"), 0);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "escaped.pcd"));
    EXPECT_TRUE(std::filesystem::exists(maps / "last.pcd")) << "saved at the stop\n" << daemon.output();
    EXPECT_TRUE(std::filesystem::exists(maps / "last.ply"));

    std::size_t forwarded = 0;
    char packet[65'536];
    while (::recv(second_reader, packet, sizeof(packet), MSG_DONTWAIT) > 0) ++forwarded;
    EXPECT_EQ(counters.at("packets_forward_failed"), 0);
    EXPECT_GT(forwarded, 10U) << "of " << sent << ", as many as the second reader's buffer holds";
    ::close(second_reader);
}

TEST(RemoteControl, AReplayWithLcmTellsItsStatusAndListens) {
    const test::TemporaryFolder folder;
    if (!test::enter_network_namespace()) GTEST_LOG_(INFO) << "no namespace of its own: on the host's loopback";
    Operator op;
    if (!op.good()) GTEST_SKIP() << "no multicast here";
    const auto capture = test::SyntheticCapture(30).write(folder.path());
    test::ChildProcess replay({DLOD_BINARY, "replay", capture.string(), "--rate", "1", "--lcm", kUrl, "--set",
                               "lcm.channel_prefix=TEST_", "--set",
                               "saved_maps.folder=" + (folder.path() / "maps").string()});
    ASSERT_TRUE(op.wait_for_pose(20, kSlower * 20s)) << replay.output();
    op.send(3, command_t::SAVE_MAP, "hall");
    const auto saved = op.answer_to(3);
    ASSERT_TRUE(saved) << replay.output();
    EXPECT_TRUE(saved->command_ok) << saved->command_answer;
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "maps/hall.pcd"));
    EXPECT_EQ(replay.wait(kSlower * 10s), 0) << replay.output();
    std::this_thread::sleep_for(200ms);
    op.stop();
    EXPECT_NE(op.last_status.sensor.find("123456"), std::string::npos);
    EXPECT_EQ(counters_of(op.last_status).at("frames"), 30) << "the last status is that of the end";
    EXPECT_GE(op.sensors.size(), 1U);
}

}  // namespace
}  // namespace dlod
