// Two-stage odometry (paper, Sec. "Overview", Eq. 4): scan to scan, then scan to submap with the first as prior.
#pragma once

#include "core/odometry/feedback.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

#include <memory>

namespace dlod {

struct OdometryConfig {
    bool use_imu = true;

    template <class V>
    void visit(V& v) {
        v.flag("use_imu", use_imu, "use the sensor's IMU for rotation, gravity and motion within the sweep");
    }
};

/// Estimates the pose of each frame in turn and keeps the local map. Fills frame.odometry.
class Odometry {
  public:
    Odometry(const SensorModel& sensor, const OdometryConfig& config);
    ~Odometry();

    /// @param feedback of the frame kFeedbackDelay before this one, or nullptr for the first frames
    void process(Frame& frame, const OdometryFeedback* feedback);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace dlod
