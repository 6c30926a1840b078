#include "daemon/service/notifier.hpp"

#include <systemd/sd-daemon.h>

namespace dlod::daemon {

void ServiceNotifier::ready(const std::string& status) const {
    ::sd_notifyf(0, "READY=1\nSTATUS=%s", status.c_str());
}
void ServiceNotifier::status(const std::string& status) const {
    ::sd_notifyf(0, "STATUS=%s", status.c_str());
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

}  // namespace dlod::daemon
