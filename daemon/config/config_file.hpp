// Reading a configuration: built-in defaults, then the sensor's preset, then a YAML file, then single settings.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/config/option.hpp"

namespace dlod::daemon {

/// Applies YAML text to `config`; keys that it does not name keep their values.
/// @param name of the file, for messages
/// @throws ConfigError for bad syntax, unknown or repeated keys, values out of range: "NAME:LINE: KEY: what is wrong",
/// a line for each
void apply_yaml(Config& config, const std::string& yaml, const std::string& name);

/// As apply_yaml, of a file. @throws ConfigError also when it cannot be read
void apply_file(Config& config, const std::filesystem::path& file);

/// Applies one "key=value". @throws ConfigError
void apply_setting(Config& config, const std::string& setting);

/// The whole configuration as commented YAML, in the order of declaration; values are those of `config`, the defaults
/// in the comments those of the program.
std::string to_yaml(const Config& config);

}  // namespace dlod::daemon
