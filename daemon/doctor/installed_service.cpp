#include "daemon/doctor/installed_service.hpp"

#include <system_error>

namespace dlod::daemon {

bool InstalledService::may_write(const std::filesystem::path& folder) const {
    const auto inside = folder.lexically_normal().lexically_relative(state_directory);
    return !inside.empty() && *inside.begin() != "..";
}

std::optional<InstalledService> service_of(const std::filesystem::path& config_file) {
    std::error_code error;
    const auto file = std::filesystem::absolute(config_file, error).lexically_normal();
    const auto folder = file.parent_path();
    if (file.extension() != ".yaml" || folder.filename() != "dlod" || folder.parent_path().filename() != "etc") {
        return std::nullopt;
    }
    const std::string name = file.stem().string();
    if (name == "dlod") return InstalledService{"dlod", "/var/lib/dlod"};
    return InstalledService{"dlod@" + name, "/var/lib/dlod-" + name};
}

}  // namespace dlod::daemon
