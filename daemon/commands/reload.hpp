// A new configuration for a running service.
#pragma once

#include <string>
#include <vector>

#include "daemon/commands/commands.hpp"
#include "daemon/config/config.hpp"
#include "driver/metadata.hpp"

namespace dlod::daemon {

/// What a reload came to.
struct Reload {
    std::vector<std::string> changed;     ///< "key: value" of what changes now; they are in the running configuration
    std::vector<std::string> at_restart;  ///< "key: value" of what the next start changes
    std::string error;                    ///< not empty: the file has errors, nothing changes
};

/// True for the keys that change in a running service: log.level, sensor.configure.*, recording.*.
bool changes_at_run_time(const std::string& key);

/// Reads the configuration again and takes what can change at run time over into `running`.
/// @param sensor for its preset; nullptr: not known yet
Reload reload(const ConfigSources& sources, const driver::SensorInfo* sensor, Config& running);

}  // namespace dlod::daemon
