#include "daemon/output/point_cloud_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace dlod::daemon {
namespace {

static_assert(sizeof(MapPoint) == 3 * sizeof(float) && std::endian::native == std::endian::little);

bool is_finite(const MapPoint& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

std::ptrdiff_t count_finite(std::span<const MapPoint> points) {
    return std::count_if(points.begin(), points.end(), is_finite);
}

void write_finite(OutputFile& file, std::span<const MapPoint> points) {
    for (const auto& point : points) {
        if (is_finite(point)) file.write(std::as_bytes(std::span(&point, 1)));
    }
}

}  // namespace

void write_pcd(OutputFile& file, std::span<const MapPoint> points, std::string_view comment) {
    file.write("# .PCD v0.7 - Point Cloud Data file format\n");
    if (!comment.empty()) file.write(fmt::format("# {}\n", comment));
    file.write(
        fmt::format("VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
                    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
                    count_finite(points)));
    write_finite(file, points);
}

void write_ply(OutputFile& file, std::span<const MapPoint> points, std::string_view comment) {
    file.write("ply\nformat binary_little_endian 1.0\ncomment metres, z up\n");
    if (!comment.empty()) file.write(fmt::format("comment {}\n", comment));
    file.write(
        fmt::format("element vertex {}\n"
                    "property float x\nproperty float y\nproperty float z\nend_header\n",
                    count_finite(points)));
    write_finite(file, points);
}

}  // namespace dlod::daemon
