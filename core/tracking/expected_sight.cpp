#include "core/tracking/expected_sight.hpp"

#include <array>

namespace dlod {

namespace {

constexpr double kSlack_m = 0.3;  // of predicted positions and limbs
constexpr double kLateral = 0.3;  // places to the left and right of the middle, in widths
constexpr int kPlaces = 9;
constexpr int kMostPlaces = 5;

}  // namespace

Sight look_at(const OrientedBox& box, const Frame& frame, const SweepProjection& projection) {
    const Eigen::Vector2d to_box = (box.center_m - frame.odometry.T_world_sensor.translation()).head<2>();
    const Eigen::Vector2d left = Eigen::Vector2d(-to_box.y(), to_box.x()).normalized();
    const double width = box.size_m.head<2>().minCoeff();
    const double reach = 0.5 * box.size_m.head<2>().norm() + kSlack_m;
    std::array<int, 4> count{};
    for (int place = 0; place < kPlaces; ++place) {
        Eigen::Vector3d p = box.center_m;
        p.head<2>() += (place % 3 - 1) * kLateral * width * left;
        p.z() += (place / 3 - 1) * 0.25 * box.size_m.z();
        const auto seen = projection.project(p);
        Sight sight = Sight::kUnknown;
        if (seen) {
            const double range = frame.cloud.range_m(seen->pixel.row, seen->pixel.column);
            const double expected = seen->range_m;
            if (range > 0.0)
                sight = range < expected - reach   ? Sight::kNearer
                        : range > expected + reach ? Sight::kFarther
                                                   : Sight::kThere;
        }
        if (++count[static_cast<std::size_t>(sight)] >= kMostPlaces) return sight;
    }
    return Sight::kUnknown;
}

}  // namespace dlod
