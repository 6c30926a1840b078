#include "daemon/service/signals.hpp"

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>

namespace dlod::daemon {
namespace {

sigset_t handled_signals() {
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set, signal);
    return set;
}

}  // namespace

SignalWaiter::SignalWaiter() {
    const sigset_t set = handled_signals();
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    signals_ = ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    if (signals_ < 0) throw std::system_error(errno, std::generic_category(), "signalfd");
}

SignalWaiter::~SignalWaiter() {
    ::close(signals_);
    const sigset_t set = handled_signals();
    pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

SignalWaiter::Event SignalWaiter::wait(int descriptor, std::chrono::milliseconds timeout) {
    pollfd watched[2] = {{signals_, POLLIN, 0}, {descriptor, POLLIN, 0}};
    if (::poll(watched, 2, static_cast<int>(timeout.count())) <= 0) return Event::kTimeout;
    signalfd_siginfo received{};
    if ((watched[0].revents & POLLIN) != 0 && ::read(signals_, &received, sizeof(received)) == sizeof(received)) {
        return received.ssi_signo == SIGHUP ? Event::kReload : Event::kStop;
    }
    return (watched[1].revents & POLLIN) != 0 ? Event::kDescriptor : Event::kTimeout;
}

}  // namespace dlod::daemon
