// Where a live run gets the sensor's metadata from.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "daemon/config/config.hpp"

namespace dlod::daemon {

struct SensorMetadata {
    std::string json;
    std::string name;  ///< of the file or sensor, for messages
};

/// The configured file's content, or else what the sensor itself gives over HTTP, after making the settings that the
/// configuration asks for. A sensor that does not answer is asked again, unless the state directory has what it gave
/// last time.
/// @param wait_before_retry sleeps; false ends the attempts
/// @return nothing where the attempts were ended
/// @throws ConfigError where neither file nor host is configured, driver::MetadataError where the file cannot be read
std::optional<SensorMetadata> obtain_metadata(const SensorConfig& config,
                                              const std::function<bool()>& wait_before_retry);

}  // namespace dlod::daemon
