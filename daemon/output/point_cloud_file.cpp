#include "daemon/output/point_cloud_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "daemon/output/output_file.hpp"

namespace dlod::daemon {
namespace {

static_assert(sizeof(MapPoint) == 3 * sizeof(float) && std::endian::native == std::endian::little);

bool is_finite(const MapPoint& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

}  // namespace

void write_pcd(const std::filesystem::path& path, std::span<const MapPoint> points) {
    const auto count = std::count_if(points.begin(), points.end(), is_finite);
    OutputFile file(path);
    file.write(
        fmt::format("# .PCD v0.7 - Point Cloud Data file format\n"
                    "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
                    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
                    count));
    for (const auto& point : points) {
        if (is_finite(point)) file.write(std::as_bytes(std::span(&point, 1)));
    }
    file.close();
}

}  // namespace dlod::daemon
