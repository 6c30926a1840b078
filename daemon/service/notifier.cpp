#include "daemon/service/notifier.hpp"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdlib>

namespace dlod::daemon {

namespace {

/// A new line would begin another message to systemd; a status may hold what a sensor says.
std::string as_one_line(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
}

}  // namespace

bool ServiceNotifier::is_service() const {
    return std::getenv("NOTIFY_SOCKET") != nullptr;
}
void ServiceNotifier::ready(const std::string& status) const {
    ::sd_notifyf(0, "READY=1\nSTATUS=%s", as_one_line(status).c_str());
}
void ServiceNotifier::status(const std::string& status) const {
    ::sd_notifyf(0, "STATUS=%s", as_one_line(status).c_str());
}
void ServiceNotifier::watchdog() const {
    ::sd_notify(0, "WATCHDOG=1");
}
void ServiceNotifier::reloading() const {
    ::sd_notify(0, "RELOADING=1");
}
void ServiceNotifier::stopping() const {
    ::sd_notify(0, "STOPPING=1");
}
void ServiceNotifier::allow(std::chrono::seconds time) const {
    ::sd_notifyf(0, "EXTEND_TIMEOUT_USEC=%lld", static_cast<long long>(std::chrono::microseconds(time).count()));
}

}  // namespace dlod::daemon
