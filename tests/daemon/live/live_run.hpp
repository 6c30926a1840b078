// The program run live in a test: its configuration, its service manager, its planner.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/child_process.hpp"
#include "tests/support/live_subscriber.hpp"
#include "tests/support/notify_socket.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::test {

using namespace std::chrono_literals;

inline constexpr const char* kLiveUrl = "udpm://239.255.76.99:17667?ttl=0";
inline constexpr std::uint16_t kLiveLcmPort = 17667;
/// The sensor's: another dlod on the host would have the usual ones.
inline constexpr std::uint16_t kLiveLidarPort = 17502;
inline constexpr std::uint16_t kLiveImuPort = 17503;

/// A sensor that sends to these ports.
inline SyntheticSensor on_live_ports(SyntheticSensor sensor = {}) {
    sensor.lidar_port = kLiveLidarPort;
    sensor.imu_port = kLiveImuPort;
    return sensor;
}

/// In a network namespace of its own where the system allows it. Ask usable() first.
class LiveRun {
  public:
    LiveRun() : own_network_(enter_network_namespace()), subscriber(kLiveUrl, "TEST_"), systemd(folder.path()) {
        if (!own_network_) GTEST_LOG_(INFO) << "no namespace of its own: on the host's loopback";
    }
    bool usable() const { return subscriber.good(); }
    bool has_own_network() const { return own_network_; }

    /// @param sensor the keys of the group, as in "host: a, lidar_port: 1"; more: whole groups, a line each
    void write_config(const std::string& sensor, const std::string& more = "") const {
        std::ofstream(config()) << "sensor: {" << sensor << "}\nlcm: {channel_prefix: TEST_, url: \"" << kLiveUrl
                                << "\", predicted_pose_every: 1}\n"
                                << more;
    }
    /// @param environment beyond systemd's, "NAME=value"
    void start(const std::vector<std::string>& arguments = {}, std::optional<unsigned long> largest_file = {},
               std::vector<std::string> environment = {}) {
        std::vector<std::string> command = {DLOD_BINARY, "run", "-c", config().string()};
        command.insert(command.end(), arguments.begin(), arguments.end());
        environment.insert(environment.end(), {systemd.variable(), "STATE_DIRECTORY=" + folder.path().string()});
        daemon = std::make_unique<ChildProcess>(
            command, ChildProcess::Options{.environment = environment, .largest_file = largest_file});
        EXPECT_TRUE(systemd.wait_for("READY=1", 10s)) << daemon->output();
    }
    /// A clean stop, within the time that is asked of it.
    void stop() {
        daemon->signal(SIGTERM);
        // Frames that are being worked on are finished: under a sanitizer alone that may take longer.
        const auto most = kTooSlowForTimes ? 20s : 2s;
        EXPECT_EQ(daemon->wait(most), 0) << "a clean stop within two seconds\n" << daemon->output();
        EXPECT_TRUE(systemd.wait_for("STOPPING=1", 1s));
    }

    static bool eventually(std::chrono::milliseconds timeout, const std::function<bool()>& condition) {
        // What holds at last is waited for: where all is slow, longer.
        return LiveSubscriber::wait_until(kTooSlowForTimes ? 12 * timeout : timeout, condition);
    }
    /// Forgets the poses so far and waits for `count` valid ones.
    bool poses_flow(std::size_t count = 5, std::chrono::milliseconds timeout = 15s) {
        subscriber.clear();
        return eventually(timeout, [&] {
            std::size_t valid = 0;
            for (const auto& pose : subscriber.poses()) valid += (pose.flags & pose_t::VALID) != 0 ? 1 : 0;
            return valid >= count;
        });
    }
    /// Waits for a status, from now on, that fulfils the condition.
    testing::AssertionResult status_says(const std::function<bool(const status_t&)>& condition,
                                         std::chrono::milliseconds timeout = 10s) const {
        const auto known = subscriber.statuses().size();
        std::vector<status_t> statuses;
        const bool fulfilled = eventually(timeout, [&] {
            statuses = subscriber.statuses();
            return statuses.size() > known && condition(statuses.back());
        });
        if (fulfilled) return testing::AssertionSuccess();
        if (statuses.empty()) return testing::AssertionFailure() << "no status\n" << daemon->output();
        return testing::AssertionFailure() << "health " << int{statuses.back().health} << " " << statuses.back().sensor
                                           << ": " << statuses.back().health_text << "\n"
                                           << daemon->output();
    }
    bool log_says(const std::string& text, std::chrono::milliseconds timeout = 5s) const {
        return eventually(timeout, [&] { return daemon->output().find(text) != std::string::npos; });
    }
    std::filesystem::path config() const { return folder.path() / "dlod.yaml"; }

  private:
    bool own_network_;

  public:
    TemporaryFolder folder;
    LiveSubscriber subscriber;
    NotifySocket systemd;
    std::unique_ptr<ChildProcess> daemon;
};

}  // namespace dlod::test
