// The service around a live run: awaits the sensor, runs a session on it, begins another when the sensor becomes
// another one, reloads the configuration, and reports all the while.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/live_session.hpp"
#include "daemon/commands/waiting_status.hpp"
#include "daemon/config/config.hpp"
#include "daemon/sensor/sensor_watch.hpp"
#include "daemon/service/log.hpp"
#include "daemon/service/notifier.hpp"
#include "daemon/service/signals.hpp"

namespace dlod::daemon {

class LiveService {
  public:
    /// Create it before any thread: it takes over the signals.
    /// @throws ConfigError, driver::MetadataError
    explicit LiveService(const ConfigSources& sources);
    ~LiveService();

    /// Until SIGTERM or SIGINT. @throws what ends a session
    void run();

  private:
    void handle(SignalWaiter::Event event);
    void reload_config();
    void begin_session_if_asked();
    void load_config_for_session();
    void postpone_session(const std::string& trouble);
    void end_session();
    void report();

    ConfigSources sources_;
    Config config_;
    SignalWaiter signals_;
    ServiceNotifier service_;
    RepeatedWarnings warnings_;
    std::unique_ptr<SensorWatch> watch_;
    std::optional<SensorMetadata> next_metadata_;  ///< of the session to begin
    std::optional<driver::SensorInfo> sensor_;     ///< of the session at work
    LiveStart start_;
    std::unique_ptr<WaitingStatus> waiting_;  ///< while there is no session
    std::unique_ptr<LiveSession> session_;
    std::string trouble_;          ///< as logged last
    std::string session_trouble_;  ///< why there is no session although there are metadata
    std::string config_trouble_;   ///< of the session's configuration, as logged last
    std::chrono::steady_clock::time_point next_attempt_{};
    bool stopping_ = false;
};

}  // namespace dlod::daemon
