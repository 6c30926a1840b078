// Signals and timers without handlers: the main thread sleeps until one comes.
#pragma once

#include <chrono>

namespace dlod::daemon {

/// Takes SIGINT, SIGTERM and SIGHUP away from their default actions, for this thread and those it starts later: create
/// it before any thread.
class SignalWaiter {
  public:
    enum class Event { kTimeout, kDescriptor, kStop, kReload };

    SignalWaiter();
    ~SignalWaiter();
    SignalWaiter(const SignalWaiter&) = delete;
    SignalWaiter& operator=(const SignalWaiter&) = delete;

    /// Sleeps until a signal, until `descriptor` is readable, or for the timeout.
    Event wait(int descriptor, std::chrono::milliseconds timeout);

  private:
    int signals_;
};

}  // namespace dlod::daemon
