// A planner's view of the service under test, minute by minute.
#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <dlod/pose_t.hpp>
#include <dlod/status_t.hpp>
#include <lcm/lcm-cpp.hpp>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tools/soak/truth_path.hpp"

namespace dlod::tools::soak {

/// What came since the last call of Monitor::take().
struct Observation {
    std::uint64_t poses = 0;
    std::uint64_t valid = 0;
    std::uint64_t predicted = 0;  ///< of valid: without registration
    double worst_error_m = 0.0;   ///< of valid poses against the truth, aligned at the first one
    double sum_squared_m2 = 0.0;  ///< of the same
    double worst_step_m = 0.0;    ///< of the way from pose to pose
    std::uint64_t statuses = 0;
    status_t last_status{};
};

/// Subscribes in a thread of its own. The service must give the sensor's time as utime.
class Monitor {
  public:
    Monitor(const std::string& url, const std::string& prefix, const TruthPath& truth);
    ~Monitor();
    Monitor(const Monitor&) = delete;
    Monitor& operator=(const Monitor&) = delete;

    bool good() const { return lcm_.good(); }
    Observation take();

  private:
    void on_pose(const lcm::ReceiveBuffer*, const std::string&, const pose_t* message);
    void on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* message);

    lcm::LCM lcm_;
    const TruthPath& truth_;
    std::mutex mutex_;  ///< guards the next five
    Observation observation_;
    std::optional<Eigen::Isometry3d> T_truth_odom_;
    Eigen::Vector3d last_odom_m_ = Eigen::Vector3d::Zero();
    Eigen::Vector3d last_truth_m_ = Eigen::Vector3d::Zero();
    bool step_known_ = false;
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

}  // namespace dlod::tools::soak
