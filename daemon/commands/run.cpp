#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/live_session.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/config/option.hpp"
#include "daemon/sensor/metadata_source.hpp"
#include "daemon/service/log.hpp"
#include "daemon/service/notifier.hpp"
#include "daemon/service/signals.hpp"

namespace dlod::daemon {
namespace {

using Clock = std::chrono::steady_clock;
using Event = SignalWaiter::Event;

constexpr auto kReportPeriod = std::chrono::seconds(1);
constexpr auto kSensorRetry = std::chrono::seconds(2);

/// Reloads the configuration: what can change in a running service does, what cannot is named, and a file with errors
/// changes nothing.
void reload(const ConfigSources& sources, const driver::SensorInfo& sensor, Config& running) {
    try {
        Config fresh = load_config(sources, &sensor);
        const auto changed = list_options(fresh);
        const auto current = list_options(running);
        for (std::size_t i = 0; i < changed.size(); ++i) {
            const auto* option = std::get_if<Option>(&changed[i]);
            if (option == nullptr || option->to_yaml() == std::get<Option>(current[i]).to_yaml()) continue;
            if (option->key == "log.level") {
                running.log.level = fresh.log.level;
                set_up_log(running.log.level);
                spdlog::info("reload: log.level is now {}", option->to_yaml());
            } else {
                spdlog::warn("reload: {} takes effect at the next restart", option->key);
            }
        }
    } catch (const ConfigError& error) {
        spdlog::error("reload: {}; the running configuration stays in force", error.what());
    }
}

/// Sleeps, unless told to stop. @return false where told to stop
bool sleep_until_retry(SignalWaiter& signals, const ServiceNotifier& service) {
    service.watchdog();
    return signals.wait(-1, kSensorRetry) != Event::kStop;
}

}  // namespace

ExitCode run(const RunArguments& arguments) {
    Config config = load_config(arguments.config, nullptr);
    set_up_log(config.log.level);
    SignalWaiter signals;
    const ServiceNotifier service;
    // A sensor that is still booting is awaited: that is no failure of the service.
    if (config.sensor.metadata.empty() && !config.sensor.host.empty())
        service.ready("waiting for sensor " + config.sensor.host);
    const auto metadata = obtain_metadata(config.sensor, [&] { return sleep_until_retry(signals, service); });
    if (!metadata) return ExitCode::kSuccess;
    const auto sensor = driver::parse_metadata(metadata->json, metadata->name);
    for (const auto& warning : sensor.warnings) spdlog::warn("{}", warning);
    config = load_config(arguments.config, &sensor);

    LiveSession session(config, sensor, metadata->json);
    session.start();
    bool stopping = false;
    auto next_report = Clock::now() + kReportPeriod;
    while (!session.done()) {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(next_report - Clock::now());
        const Event event = signals.wait(session.done_descriptor(), std::max(left, std::chrono::milliseconds(0)));
        if (event == Event::kStop && !std::exchange(stopping, true)) {
            service.stopping();
            session.stop();
        }
        if (event == Event::kReload) {
            service.reloading();
            reload(arguments.config, sensor, config);
            service.ready(session.one_line());
        }
        if (Clock::now() < next_report) continue;
        next_report += kReportPeriod;
        session.report();
    }
    session.finish();
    return ExitCode::kSuccess;
}

}  // namespace dlod::daemon
