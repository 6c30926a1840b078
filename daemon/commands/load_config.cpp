#include "daemon/commands/load_config.hpp"

#include "daemon/config/config_file.hpp"
#include "daemon/config/consistency.hpp"
#include "daemon/config/option.hpp"
#include "daemon/config/presets.hpp"

namespace dlod::daemon {

Config load_config(const ConfigSources& sources, const driver::SensorInfo* sensor) {
    Config config;
    if (const Preset* preset = sensor != nullptr ? find_preset(*sensor) : nullptr) {
        for (const auto& setting : preset->settings) apply_setting(config, setting);
    }
    if (sources.file) apply_file(config, *sources.file);
    for (const auto& setting : sources.settings) apply_setting(config, setting);
    try {
        check_consistency(config);
    } catch (const ConfigError& error) {
        if (!sources.file) throw;
        throw ConfigError(sources.file->string() + ": " + error.what());
    }
    return config;
}

}  // namespace dlod::daemon
