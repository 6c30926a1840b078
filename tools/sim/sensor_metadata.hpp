// Metadata files of sensors that need not exist.
#pragma once

#include <string>
#include <string_view>

namespace dlod::tools::sim {

/// Metadata (JSON) as of firmware 3.x of a made-up sensor such as OS0-128, OS1-64, OS1-32 or OS2-128: product line and
/// rows (16, 32, 64, 128). Profile and mode are the sensor's usual ones. Throws std::invalid_argument.
std::string make_metadata(std::string_view sensor);

/// The same metadata with another profile, or another mode such as 2048x10; both as Ouster names them.
/// Throws std::invalid_argument.
std::string with_profile(const std::string& metadata, const std::string& profile);
std::string with_mode(const std::string& metadata, const std::string& mode);

}  // namespace dlod::tools::sim
