#include "tools/eval/map_score.hpp"

#include <array>
#include <cmath>
#include <nanoflann.hpp>
#include <set>

#include "tools/eval/point_files.hpp"

namespace dlod::tools {
namespace {

constexpr double kNear_m = 0.25;
constexpr double kCovered_m = 0.5;
constexpr std::size_t kStaticStride = 7;  // static points looked up, one in so many

/// Answers whether a point of the cloud lies near a given one.
class Neighbours {
  public:
    explicit Neighbours(const PointList& points) : points_{points} {}

    bool within(const Eigen::Vector3d& p, double distance_m) const {
        if (points_.list.empty()) return false;
        std::size_t index = 0;
        double squared = 0.0;
        tree_.knnSearch(p.data(), 1, &index, &squared);
        return squared <= distance_m * distance_m;
    }

  private:
    struct Adaptor {
        const PointList& list;
        std::size_t kdtree_get_point_count() const { return list.size(); }
        double kdtree_get_pt(std::size_t i, std::size_t axis) const { return list[i][static_cast<Eigen::Index>(axis)]; }
        template <class Box>
        bool kdtree_get_bbox(Box&) const {
            return false;
        }
    };
    using Tree =
        nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3, std::size_t>;

    Adaptor points_;
    Tree tree_{3, points_, nanoflann::KDTreeSingleIndexAdaptorParams(16)};
};

/// The first point of each cell.
PointList one_a_cell(const PointList& points) {
    std::set<std::array<int, 3>> seen;
    PointList kept;
    for (const auto& p : points) {
        const Eigen::Vector3i cell = (p / kNear_m).array().floor().cast<int>();
        if (seen.insert({cell.x(), cell.y(), cell.z()}).second) kept.push_back(p);
    }
    return kept;
}

}  // namespace

MapScore score_map(const Truth& truth, const std::filesystem::path& map, const Eigen::Isometry3d& T_true_run) {
    const PointList static_points = read_npy(truth.folder / "map_static.npy");
    const PointList moving_points = read_npy(truth.folder / "map_moving.npy");
    PointList mapped = one_a_cell(read_pcd(map));
    for (auto& p : mapped) p = T_true_run * p;

    MapScore score;
    score.points = static_cast<int>(mapped.size());
    const Neighbours near_static(static_points);
    const Neighbours near_moving(moving_points);
    for (const auto& p : mapped)
        score.ghosts += !near_static.within(p, kNear_m) && near_moving.within(p, kNear_m) ? 1 : 0;

    const Neighbours near_mapped(mapped);
    int looked_up = 0;
    int covered = 0;
    for (std::size_t i = 0; i < static_points.size(); i += kStaticStride) {
        ++looked_up;
        covered += near_mapped.within(static_points[i], kCovered_m) ? 1 : 0;
    }
    score.kept_pct = looked_up > 0 ? 100.0 * covered / looked_up : 0.0;
    return score;
}

}  // namespace dlod::tools
