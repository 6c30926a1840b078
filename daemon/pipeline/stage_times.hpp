// How long each step took for one frame.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <ctime>

namespace dlod::daemon {

/// The steps that are timed, in the order in which a frame passes them.
enum class Step : std::uint8_t {
    kIngest,       ///< decoding its packets into the frame
    kGeometry,     ///< xyz of every pixel
    kSubsampling,  ///< points and normals for the registration
    kGround,
    kSegmentation,
    kOdometry,
    kDetection,
    kTracking,
    kRemoval,
    kPublish,
    kMap,
    kWrite,  ///< result files; of this frame's own row only the frame before's is known
};
inline constexpr std::size_t kStepCount = 12;
inline constexpr std::array<const char*, kStepCount> kStepNames = {
    "ingest",    "geometry", "subsampling", "ground",  "segmentation", "odometry",
    "detection", "tracking", "removal",     "publish", "map",          "write"};

/// Milliseconds a step, elapsed and of the thread's CPU time.
struct StageTimes {
    std::array<float, kStepCount> wall_ms{};
    std::array<float, kStepCount> cpu_ms{};
};

/// Adds the time of its own lifetime to one step of `times`.
class StepTimer {
  public:
    StepTimer(StageTimes& times, Step step) : times_(times), step_(static_cast<std::size_t>(step)) {}
    ~StepTimer() {
        times_.wall_ms[step_] += static_cast<float>(1e-6 * static_cast<double>(now_ns(CLOCK_MONOTONIC) - wall_ns_));
        times_.cpu_ms[step_] +=
            static_cast<float>(1e-6 * static_cast<double>(now_ns(CLOCK_THREAD_CPUTIME_ID) - cpu_ns_));
    }
    StepTimer(const StepTimer&) = delete;
    StepTimer& operator=(const StepTimer&) = delete;

    static std::int64_t now_ns(clockid_t clock) {
        timespec t{};
        ::clock_gettime(clock, &t);
        return 1'000'000'000 * static_cast<std::int64_t>(t.tv_sec) + t.tv_nsec;
    }

  private:
    StageTimes& times_;
    std::size_t step_;
    std::int64_t wall_ns_ = now_ns(CLOCK_MONOTONIC);
    std::int64_t cpu_ns_ = now_ns(CLOCK_THREAD_CPUTIME_ID);
};

}  // namespace dlod::daemon
