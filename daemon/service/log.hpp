#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace dlod::daemon {

/// Sends log messages of at least `level` (spdlog's numbers: 0 trace .. 6 off) to stderr, to the journal with
/// their priorities; it adds the time.
void set_up_log(int level);

/// Warnings that may come again and again: each kind is written at once, then at most once an interval with the number
/// of those in between. From any thread.
class RepeatedWarnings {
  public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::size_t kMostKinds = 100;  ///< memory and log stay bounded, whatever a sensor says
    explicit RepeatedWarnings(std::chrono::seconds interval = std::chrono::seconds(10)) : interval_(interval) {}

    /// @param kind what counts as the same warning; those beyond the first kMostKinds count as one
    /// @return true where it was written
    bool warn(const std::string& kind, const std::string& message, Clock::time_point now = Clock::now());

  private:
    struct Kind {
        Clock::time_point written;
        std::uint64_t held_back = 0;
    };
    std::chrono::seconds interval_;
    std::mutex mutex_;
    std::map<std::string, Kind> kinds_;
};

}  // namespace dlod::daemon
