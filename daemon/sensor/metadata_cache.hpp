// The last metadata that a sensor gave, so that the service starts while the sensor is still booting.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace dlod::daemon {

/// One file a sensor host in the state directory.
class MetadataCache {
  public:
    MetadataCache(const std::filesystem::path& state_directory, const std::string& host);

    std::optional<std::string> load() const;

    /// Replaces the file in one step: a crash or a loss of power leaves the old or the new text, never half of one.
    /// @return an error text that names the file, or nothing
    std::optional<std::string> store(const std::string& metadata) const;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

}  // namespace dlod::daemon
