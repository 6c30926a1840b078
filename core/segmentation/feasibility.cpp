#include "core/segmentation/feasibility.hpp"

#include <array>
#include <functional>

namespace dlod {

bool is_too_large(float height_m, float length_m, float max_range_m, const FeasibilityConfig& config) {
    return static_cast<double>(height_m) > config.max_height_m || static_cast<double>(length_m) > config.max_length_m ||
           static_cast<double>(max_range_m) > config.max_range_m;
}

bool is_feasible(const Segment& segment, const FeasibilityConfig& config) {
    if (segment.count < static_cast<std::uint32_t>(config.min_points) || segment.rows < config.min_rows) return false;
    const Eigen::Vector3d size = (segment.max_m - segment.min_m).cast<double>();
    if (size.z() < config.min_height_m) return false;
    if (is_too_large(segment.max_m.z() - segment.min_m.z(), segment.length_m, segment.max_range_m, config))
        return false;
    if (static_cast<double>(segment.min_m.z()) > config.max_lowest_point_m) return false;
    std::array<double, 3> sides{size.x(), size.y(), size.z()};
    std::sort(sides.begin(), sides.end(), std::greater<>());
    return sides[0] <= config.max_side_ratio * sides[1];
}

}  // namespace dlod
