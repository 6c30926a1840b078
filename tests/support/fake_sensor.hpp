// A sensor as a service sees it: HTTP on a loopback port, packets by UDP at true rate.
#pragma once

#include <httplib.h>

#include <atomic>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "tests/support/synthetic_capture.hpp"

namespace dlod::test {

/// Stands still in the hall of SyntheticCapture. What happens to sensors can be done to it while it runs.
class FakeSensor {
  public:
    explicit FakeSensor(const SyntheticSensor& sensor = {});
    ~FakeSensor();
    FakeSensor(const FakeSensor&) = delete;
    FakeSensor& operator=(const FakeSensor&) = delete;

    /// For sensor.host.
    std::string host() const { return "127.0.0.1:" + std::to_string(port_); }

    /// Sends nothing and answers no question, until plugged in, when it starts anew.
    void unplug();
    void plug_in();
    /// Is silent and initializing for a moment; comes back with another init id, its clock and frames begin anew.
    void restart();
    /// Another one in its place, with the settings that it brings.
    void become(const SyntheticSensor& sensor);
    /// Somebody sets it over HTTP, as POST does: {"udp_dest": "10.0.0.9"}.
    void set(const nlohmann::json& settings);

    SyntheticSensor sensor() const;
    nlohmann::json settings() const;
    /// Of others' making over HTTP.
    int settings_made() const { return settings_made_; }
    /// Answers 503 to everything: its web server is not up.
    std::atomic<bool> answers{true};

  private:
    static constexpr std::int64_t kBootTime_ns = 5'000'000'000;

    void serve();
    void send();
    void begin_anew();
    static nlohmann::json settings_of(const SyntheticSensor& sensor);

    mutable std::mutex mutex_;  ///< guards the next five
    SyntheticSensor sensor_;
    nlohmann::json settings_;
    bool plugged_in_ = true;
    std::chrono::steady_clock::time_point running_since_;
    int frame_ = 0;

    std::atomic<int> settings_made_{0};
    std::atomic<bool> stopping_{false};
    httplib::Server server_;
    int port_ = 0;
    std::thread http_;
    std::thread udp_;
};

}  // namespace dlod::test
