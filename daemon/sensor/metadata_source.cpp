#include "daemon/sensor/metadata_source.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "daemon/config/option.hpp"
#include "daemon/sensor/metadata_cache.hpp"
#include "daemon/sensor/sensor_client.hpp"
#include "driver/metadata.hpp"

namespace dlod::daemon {
namespace {

SensorMetadata read_file(const std::string& name) {
    std::ifstream file(name, std::ios::binary);
    std::string json{std::istreambuf_iterator<char>(file), {}};
    if (!file || json.empty()) {
        throw driver::MetadataError(
            fmt::format("{}: cannot be read; set sensor.metadata to the sensor's metadata file", name));
    }
    return {std::move(json), name};
}

SensorSettings settings_of(const ConfigureSensorConfig& config) {
    const auto wanted = [](const std::string& text) { return text.empty() ? std::nullopt : std::optional(text); };
    SensorSettings settings;
    settings.udp_dest = wanted(config.udp_dest);
    settings.lidar_mode = wanted(config.lidar_mode);
    settings.lidar_profile = wanted(config.lidar_profile);
    settings.timestamp_mode = wanted(config.timestamp_mode);
    return settings;
}

/// systemd names the directory; by hand, nothing is kept.
std::optional<MetadataCache> cache_for(const std::string& host) {
    const char* directory = std::getenv("STATE_DIRECTORY");
    if (directory == nullptr) return std::nullopt;
    return MetadataCache(directory, host);
}

}  // namespace

std::optional<SensorMetadata> obtain_metadata(const SensorConfig& config,
                                              const std::function<bool()>& wait_before_retry) {
    if (!config.metadata.empty()) return read_file(config.metadata);
    if (config.host.empty()) {
        throw ConfigError(
            "sensor.metadata: a live run needs the sensor's metadata file, or sensor.host to ask the sensor itself");
    }
    const SensorClient client(config.host);
    const auto cache = cache_for(config.host);
    const auto settings = settings_of(config.configure);
    while (true) {
        try {
            if (!settings.empty()) client.apply(settings);
            SensorMetadata metadata{client.fetch_metadata(), "sensor " + config.host};
            const auto trouble = cache ? cache->store(metadata.json) : std::nullopt;
            if (trouble) spdlog::warn("{}", *trouble);
            return metadata;
        } catch (const SensorError& error) {
            spdlog::warn("{}", error.what());
        }
        if (auto kept = cache ? cache->load() : std::nullopt) {
            spdlog::warn("sensor {}: going on with the metadata that it gave last time", config.host);
            return SensorMetadata{std::move(*kept), cache->path().string()};
        }
        if (!wait_before_retry()) return std::nullopt;
    }
}

}  // namespace dlod::daemon
