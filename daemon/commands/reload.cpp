#include "daemon/commands/reload.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <variant>

#include "daemon/commands/load_config.hpp"
#include "daemon/config/option.hpp"

namespace dlod::daemon {

bool changes_at_run_time(const std::string& key) {
    return key == "log.level" || key.starts_with("sensor.configure.") || key.starts_with("recording.");
}

Reload reload(const ConfigSources& sources, const driver::SensorInfo* sensor, Config& running) {
    Reload result;
    Config fresh;
    try {
        fresh = load_config(sources, sensor);
    } catch (const ConfigError& error) {
        result.error = error.what();
        return result;
    }
    const OptionList wanted = list_options(fresh);
    const OptionList current = list_options(running);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        const auto* option = std::get_if<Option>(&wanted[i]);
        if (option == nullptr || option->to_yaml() == std::get<Option>(current[i]).to_yaml()) continue;
        auto& list = changes_at_run_time(option->key) ? result.changed : result.at_restart;
        list.push_back(fmt::format("{}: {}", option->key, option->to_yaml()));
    }
    running.log = fresh.log;
    running.sensor.configure = fresh.sensor.configure;
    running.recording = fresh.recording;
    return result;
}

}  // namespace dlod::daemon
