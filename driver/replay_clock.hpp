// When a captured packet is due in a replay: arithmetic only.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace dlod::driver {

/// Maps capture time to a steady clock, at a rate. The first packet is due when it comes; every later one at its
/// distance in capture time, divided by the rate, so that delays do not add up. Where the capture's time runs
/// backwards, or ahead by more than the longest gap, the clock starts anew there.
class ReplayClock {
  public:
    /// `rate` 1 is true rate, 2 twice as fast, 0 or less as fast as possible.
    explicit ReplayClock(double rate, std::int64_t longest_gap_ns = 10'000'000'000)
        : rate_(rate), longest_gap_ns_(longest_gap_ns) {}

    /// Nanoseconds from `now_ns` (steady clock) until the packet captured at `capture_ns` is due; 0 if it is.
    std::int64_t wait_ns(std::int64_t capture_ns, std::int64_t now_ns) {
        if (!(rate_ > 0.0)) return 0;
        const std::int64_t step_ns = capture_ns - last_capture_ns_.value_or(capture_ns);
        if (!last_capture_ns_ || step_ns < -kReordering_ns || step_ns > longest_gap_ns_) {
            first_capture_ns_ = capture_ns;
            first_due_ns_ = now_ns;
        }
        last_capture_ns_ = capture_ns;
        // The bound keeps tiny rates and odd capture times within 64 bits.
        constexpr double kLongest_ns = 1e17;
        const double elapsed_ns =
            std::clamp(static_cast<double>(capture_ns - first_capture_ns_) / rate_, -kLongest_ns, kLongest_ns);
        return std::max<std::int64_t>(0, first_due_ns_ + static_cast<std::int64_t>(elapsed_ns) - now_ns);
    }

  private:
    /// Captures of several queues are out of order by a little: no reason to start anew.
    static constexpr std::int64_t kReordering_ns = 1'000'000'000;

    double rate_;
    std::int64_t longest_gap_ns_;
    std::optional<std::int64_t> last_capture_ns_;
    std::int64_t first_capture_ns_ = 0;
    std::int64_t first_due_ns_ = 0;
};

}  // namespace dlod::driver
