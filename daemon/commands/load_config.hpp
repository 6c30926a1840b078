#pragma once

#include "daemon/commands/commands.hpp"
#include "daemon/config/config.hpp"
#include "driver/metadata.hpp"

namespace dlod::daemon {

/// Defaults, then the sensor's preset, then file, then settings; checked as a whole.
/// @param sensor nullptr: no preset
/// @throws ConfigError
Config load_config(const ConfigSources& sources, const driver::SensorInfo* sensor);

}  // namespace dlod::daemon
