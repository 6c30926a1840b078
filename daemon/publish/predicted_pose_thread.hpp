// Predicted poses on a thread of their own: who receives the IMU's readings waits for nobody who takes messages.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <functional>
#include <thread>

#include "core/types/imu_sample.hpp"
#include "daemon/pipeline/worker_pool.hpp"
#include "driver/counter.hpp"

namespace dlod::daemon {

class PredictedPoseThread {
  public:
    /// Readings that may wait: at 100 Hz less than a third of a second, older ones predict nothing of use.
    static constexpr std::size_t kMostWaiting = 32;

    /// @param publish is given the readings one by one, on the thread
    /// @param on_start called first on the thread; may be empty
    PredictedPoseThread(std::function<void(const ImuSample&)> publish, std::function<void()> on_start);
    /// Waits for a reading that is being published; those behind it are left out.
    ~PredictedPoseThread();
    PredictedPoseThread(const PredictedPoseThread&) = delete;
    PredictedPoseThread& operator=(const PredictedPoseThread&) = delete;

    /// Hands a reading over and returns at once. Where too many wait it is left out and counted. For one thread.
    void add(const ImuSample& sample);

    /// Readings that were left out; from any thread.
    std::uint64_t left_out() const { return left_out_.value(); }

  private:
    void work();

    std::function<void(const ImuSample&)> publish_;
    boost::lockfree::spsc_queue<ImuSample, boost::lockfree::capacity<kMostWaiting>> waiting_;
    EventCount events_;
    std::atomic<bool> stopping_{false};
    driver::Counter left_out_;
    std::thread thread_;  // last: it uses all of the above
};

}  // namespace dlod::daemon
