// A planner's view of the service under test, minute by minute.
#pragma once

#include <atomic>
#include <cstdint>
#include <dlod/pose_t.hpp>
#include <dlod/status_t.hpp>
#include <lcm/lcm-cpp.hpp>
#include <mutex>
#include <string>
#include <thread>

#include "tools/eval/pose_series.hpp"

namespace dlod::tools::soak {

/// What came since the last call of Monitor::take().
struct Observation {
    std::uint64_t poses = 0;
    std::uint64_t predicted = 0;  ///< of the valid ones: without registration
    PoseSeries valid;
    std::uint64_t statuses = 0;
    status_t last_status{};
};

/// Subscribes in a thread of its own. The service must give the sensor's time as utime.
class Monitor {
  public:
    Monitor(const std::string& url, const std::string& prefix);
    ~Monitor();
    Monitor(const Monitor&) = delete;
    Monitor& operator=(const Monitor&) = delete;

    bool good() const { return lcm_.good(); }
    Observation take();

  private:
    void on_pose(const lcm::ReceiveBuffer*, const std::string&, const pose_t* message);
    void on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* message);

    lcm::LCM lcm_;
    std::mutex mutex_;  ///< guards the next one
    Observation observation_;
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

}  // namespace dlod::tools::soak
