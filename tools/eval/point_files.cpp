#include "tools/eval/point_files.hpp"

#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <cstdint>
#include <cstring>
#include <regex>
#include <stdexcept>

#include "tools/eval/csv_table.hpp"

namespace dlod::tools {

PointList read_pcd(const std::filesystem::path& path) {
    pcl::PointCloud<pcl::PointXYZ> cloud;
    if (pcl::PCDReader().read(path.string(), cloud) != 0)
        throw std::runtime_error(path.string() + ": cannot be read as PCD");
    PointList points;
    points.reserve(cloud.size());
    for (const auto& p : cloud) points.emplace_back(p.x, p.y, p.z);
    return points;
}

PointList read_npy(const std::filesystem::path& path) {
    const std::string content = read_file(path);
    const auto fail = [&](const char* what) -> std::runtime_error {
        return std::runtime_error(path.string() + ": " + what);
    };
    constexpr std::size_t kVersionAt = 6;
    if (content.size() < 12 || content.compare(0, kVersionAt, "\x93NUMPY") != 0) throw fail("not a NumPy file");
    const bool long_header = content[kVersionAt] != 1;
    std::uint32_t header_bytes = 0;
    std::memcpy(&header_bytes, content.data() + 8, long_header ? 4 : 2);
    const std::size_t data_at = (long_header ? 12 : 10) + static_cast<std::size_t>(header_bytes);
    if (data_at > content.size()) throw fail("header cut short");
    const std::string header = content.substr(0, data_at);
    std::smatch match;
    if (header.find("'<f4'") == std::string::npos || header.find("'fortran_order': False") == std::string::npos ||
        !std::regex_search(header, match, std::regex(R"('shape': \((\d+), 3\))"))) {
        throw fail("not an N x 3 array of float32 in C order");
    }
    const std::size_t count = std::stoull(match[1]);
    if (content.size() - data_at < count * 3 * sizeof(float)) throw fail("data cut short");
    PointList points(count);
    for (std::size_t i = 0; i < count; ++i) {
        float xyz[3];
        std::memcpy(xyz, content.data() + data_at + i * sizeof xyz, sizeof xyz);
        points[i] = {xyz[0], xyz[1], xyz[2]};
    }
    return points;
}

}  // namespace dlod::tools
