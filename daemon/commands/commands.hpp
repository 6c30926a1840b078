// The subcommands of dlod. Each returns the exit code, prints results to stdout and what goes wrong to stderr, and
// throws the errors that main() turns into exit codes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/commands/exit_code.hpp"

namespace dlod::daemon {

/// How a command comes to its configuration: later entries win over earlier ones and over the preset.
struct ConfigSources {
    std::optional<std::filesystem::path> file;
    std::vector<std::string> settings;  ///< "key=value"
};

struct ReplayArguments {
    std::filesystem::path capture;
    std::optional<std::filesystem::path> metadata;  ///< the capture's name with .json
    ConfigSources config;
    double rate = 0.0;  ///< 0: as fast as possible, 1: true rate
};

struct RunArguments {
    ConfigSources config;
};

struct SendArguments {
    int command = 0;  ///< one of command_t's constants
    std::string argument;
    double timeout_s = 15.0;
    ConfigSources config;  ///< for lcm.url and lcm.channel_prefix
};

ExitCode replay(const ReplayArguments& arguments);
ExitCode run(const RunArguments& arguments);
/// Tells a running dlod to do something and prints its answer; fails where it could not do it.
ExitCode send_command(const SendArguments& arguments);
/// Checks the machine for what the configuration needs; fails where dlod could not do its job.
ExitCode doctor(const ConfigSources& config);
/// Sensor, profile, packets, frames, losses and duration of a capture; of a metadata file the sensor alone.
ExitCode info(const std::filesystem::path& file, const std::optional<std::filesystem::path>& metadata);
ExitCode check_config(const ConfigSources& config, const std::optional<std::filesystem::path>& metadata);
ExitCode print_config(const ConfigSources& config, const std::optional<std::filesystem::path>& metadata);

}  // namespace dlod::daemon
