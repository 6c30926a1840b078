// What systemd is told about the service (sd_notify); nothing happens where systemd did not start it.
#pragma once

#include <chrono>
#include <string>

namespace dlod::daemon {

class ServiceNotifier {
  public:
    /// Somebody listens: systemd started this program, as a service.
    bool is_service() const;
    void ready(const std::string& status) const;
    void status(const std::string& status) const;
    /// "Still alive". Call it only while the work moves on.
    void watchdog() const;
    /// A reload has begun; ready() ends it.
    void reloading() const;
    void stopping() const;
    /// What is under way may take as long, whatever the unit allows for it.
    void allow(std::chrono::seconds time) const;
};

}  // namespace dlod::daemon
