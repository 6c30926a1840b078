// A sensor on a bad network: a lap of a drive again and again at true rate, with all that may happen on the way.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "driver/metadata.hpp"
#include "driver/packet_format.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::soak {

struct FaultySensorOptions {
    std::filesystem::path capture;  ///< of a drive that ends as it began (dlod-sim --lap)
    int lap_frames = 0;             ///< in it
    driver::SensorInfo sensor;
    std::uint16_t lidar_port = 0;
    std::uint16_t imu_port = 0;
    double seconds = 300.0;
    double loss = 0.01;
    double duplication = 0.01;
    double reordering = 0.02;          ///< share that comes one to three packets late
    double burst_every_s = 7.0;        ///< everything is held back for kBurst, then comes at once
    double restart_every_s = 60.0;     ///< at the end of a lap, where the robot stands
    double garbage_per_second = 50.0;  ///< from another address
};

/// What was sent; times are the sensor's.
struct SentTotals {
    std::uint64_t packets = 0;  ///< of the lidar that the sensor would have sent
    std::uint64_t lost = 0;
    std::uint64_t duplicated = 0;
    std::uint64_t reordered = 0;
    std::uint64_t bursts = 0;
    std::uint64_t restarts = 0;
    std::uint64_t garbage = 0;
    std::uint64_t frames = 0;  ///< turns of the sensor in which it was not starting
};

class FaultySensor {
  public:
    explicit FaultySensor(FaultySensorOptions options);
    ~FaultySensor();
    FaultySensor(const FaultySensor&) = delete;
    FaultySensor& operator=(const FaultySensor&) = delete;

    /// Sends until the time is over or stop() was called; blocks.
    void run();
    void stop() { stopping_ = true; }
    SentTotals totals() const;

  private:
    struct Waiting {
        std::vector<std::byte> bytes;
        int packets_left = 0;  ///< that pass before it
    };

    bool over() const;
    void send_lap(std::int64_t lap, bool restart_at_end);
    void send_garbage();
    void pass_lidar(const std::vector<std::byte>& bytes);
    void transmit(const std::vector<std::byte>& bytes, std::uint16_t port) const;

    FaultySensorOptions options_;
    std::atomic<bool> stopping_{false};
    driver::PacketLayout layout_;
    std::int64_t turn_ns_;
    std::int64_t lap_ns_;
    std::uint32_t restarts_ = 0;
    std::int64_t restarted_in_lap_ = 0;
    std::chrono::steady_clock::time_point start_;
    sim::Random random_;
    std::vector<Waiting> late_;
    int socket_;
    mutable std::mutex mutex_;  ///< guards the totals
    SentTotals totals_;
};

}  // namespace dlod::tools::soak
