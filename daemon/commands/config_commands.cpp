#include <cstdio>
#include <optional>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/config/config_file.hpp"

namespace dlod::daemon {
namespace {

Config load(const ConfigSources& sources, const std::optional<std::filesystem::path>& metadata) {
    std::optional<driver::SensorInfo> sensor;
    if (metadata) sensor = driver::load_metadata(*metadata);
    return load_config(sources, sensor ? &*sensor : nullptr);
}

}  // namespace

ExitCode check_config(const ConfigSources& sources, const std::optional<std::filesystem::path>& metadata) {
    load(sources, metadata);
    std::printf("%s: valid\n", sources.file->c_str());
    return ExitCode::kSuccess;
}

ExitCode print_config(const ConfigSources& sources, const std::optional<std::filesystem::path>& metadata) {
    std::fputs(to_yaml(load(sources, metadata)).c_str(), stdout);
    return ExitCode::kSuccess;
}

}  // namespace dlod::daemon
