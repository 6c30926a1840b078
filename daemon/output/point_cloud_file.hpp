#pragma once

#include <filesystem>
#include <span>

#include "core/map/global_map.hpp"

namespace dlod::daemon {

/// Writes points as PCD 0.7, DATA binary, fields x y z (float32, metres); points that are not finite are left out.
/// Our own dozen lines: PCL's writer would load VTK into the daemon.
/// @throws OutputError
void write_pcd(const std::filesystem::path& path, std::span<const MapPoint> points);

}  // namespace dlod::daemon
