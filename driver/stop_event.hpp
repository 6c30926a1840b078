// Ends a wait at once, from any thread or a signal handler.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

#include "driver/packet_source.hpp"

namespace dlod::driver {

/// An eventfd that becomes readable once and stays so.
class StopEvent {
  public:
    StopEvent() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
        if (fd_ < 0) throw SourceError(std::string("no eventfd: ") + std::strerror(errno));
    }
    ~StopEvent() { ::close(fd_); }
    StopEvent(const StopEvent&) = delete;
    StopEvent& operator=(const StopEvent&) = delete;

    void set() noexcept {
        const int saved = errno;
        const std::uint64_t one = 1;
        // It fails only if the counter is full, and then it is readable all the same.
        [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof one);
        errno = saved;
    }

    /// For poll: readable (POLLIN) once set.
    int fd() const { return fd_; }

  private:
    int fd_;
};

}  // namespace dlod::driver
