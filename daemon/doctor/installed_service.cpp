#include "daemon/doctor/installed_service.hpp"

#include <algorithm>
#include <system_error>

namespace dlod::daemon {
namespace {

bool is_in(const std::filesystem::path& path, const std::filesystem::path& folder) {
    const auto inside = path.lexically_normal().lexically_relative(folder);
    return !inside.empty() && *inside.begin() != "..";
}

}  // namespace

bool InstalledService::may_write(const std::filesystem::path& folder) const {
    return is_in(folder, state_directory);
}

bool InstalledService::may_see(const std::filesystem::path& file) const {
    const auto hidden = {"/home", "/root", "/run/user"};  // ProtectHome=
    return std::none_of(hidden.begin(), hidden.end(), [&](const char* folder) { return is_in(file, folder); });
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
