#pragma once

#include <filesystem>
#include <optional>

#include "driver/metadata.hpp"

namespace dlod::daemon {

/// The sensor of a capture: by the metadata file given, else by the capture's name with .json.
/// @throws driver::SourceError  the capture cannot be read: said first, as its metadata is of no use then
/// @throws driver::MetadataError
driver::SensorInfo load_capture_metadata(const std::filesystem::path& capture,
                                         const std::optional<std::filesystem::path>& metadata);

}  // namespace dlod::daemon
