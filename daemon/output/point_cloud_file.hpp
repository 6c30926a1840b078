// Points as files that other programs read.
#pragma once

#include <span>
#include <string_view>

#include "core/map/cell_table.hpp"
#include "daemon/output/output_file.hpp"

namespace dlod::daemon {

// Our own dozen lines each: PCL's writers would load VTK into the daemon. Points that are not finite are left out.

/// Writes points as PCD 0.7, DATA binary, fields x y z (float32, metres). @param comment a line for the header; empty:
/// none @throws OutputError
void write_pcd(OutputFile& file, std::span<const MapPoint> points, std::string_view comment = {});
/// Writes points as PLY 1.0, binary little-endian, properties x y z (float32, metres), comment as above.
/// @throws OutputError
void write_ply(OutputFile& file, std::span<const MapPoint> points, std::string_view comment = {});

}  // namespace dlod::daemon
