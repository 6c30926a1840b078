// Which service runs with a configuration file, and where its relative folders are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace dlod::daemon {

struct InstalledService {
    std::string unit;                       ///< "dlod", "dlod@front"
    std::filesystem::path state_directory;  ///< the unit's working directory, and the only one where it may write

    /// What a folder or file of the configuration means to the service.
    std::filesystem::path resolve(const std::filesystem::path& path) const { return state_directory / path; }
    bool may_write(const std::filesystem::path& folder) const;
    /// False for what its unit hides from it: home directories.
    bool may_see(const std::filesystem::path& file) const;
};

/// By the place of the file, as in the units: etc/dlod/dlod.yaml is dlod's, etc/dlod/NAME.yaml that of dlod@NAME.
/// @return nothing where no unit reads it
std::optional<InstalledService> service_of(const std::filesystem::path& config_file);

}  // namespace dlod::daemon
