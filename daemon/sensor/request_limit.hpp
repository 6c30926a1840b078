#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

#include "driver/stop_event.hpp"

namespace dlod::daemon {

/// Ends a request over TCP that takes longer, or brings more, than it may: httplib bounds neither for what comes before
/// the body of an answer. Looks at the connection from a thread of its own, as long as it exists.
class RequestLimit {
  public:
    /// @param cut_off ends the request, from another thread; called again until the request has ended
    RequestLimit(std::uint64_t most_bytes, std::chrono::milliseconds longest, std::function<void()> cut_off);
    ~RequestLimit();
    RequestLimit(const RequestLimit&) = delete;
    RequestLimit& operator=(const RequestLimit&) = delete;

    /// The connection of the request, as soon as there is one.
    void set_socket(int socket) { socket_ = socket; }
    /// True where it brought more than it may.
    bool too_large() const { return too_large_; }

  private:
    void watch();

    const std::uint64_t most_bytes_;
    const std::chrono::steady_clock::time_point deadline_;
    std::function<void()> cut_off_;
    std::atomic<int> socket_{-1};
    std::atomic<bool> too_large_{false};
    driver::StopEvent finished_;
    std::thread thread_;  // last: it uses all of the above
};

}  // namespace dlod::daemon
