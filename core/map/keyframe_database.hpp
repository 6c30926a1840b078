// Keyframes, and the choice of those that make up the submap (paper, Sec. "Overview"; Chen et al., DLO).
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/map/voxel_map.hpp"
#include "core/odometry/feedback.hpp"
#include "core/types/lie.hpp"
#include "core/types/oriented_box.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct KeyframeConfig {
    double distance_share = 0.1;
    double min_distance_m = 0.3;
    double max_distance_m = 5.0;
    double angle_deg = 30.0;
    int nearest = 20;
    int convex_hull = 5;
    int concave_hull = 5;
    double concave_alpha_m = 5.0;
    int max_keyframes = 300;

    template <class V>
    void visit(V& v) {
        v.parameter("distance_share", distance_share, Range{0.01, 1.0}, "",
                    "a keyframe every so many times the median range (spaciousness)");
        v.parameter("min_distance_m", min_distance_m, Range{0.05, 50.0}, "m",
                    "but never nearer to each other than this");
        v.parameter("max_distance_m", max_distance_m, Range{0.1, 100.0}, "m", "and never farther than this");
        v.parameter("angle_deg", angle_deg, Range{5.0, 180.0}, "deg", "or after a turn by this angle");
        v.parameter("nearest", nearest, Range{1, 200}, "keyframes", "the nearest ones, in the submap");
        v.parameter("convex_hull", convex_hull, Range{0, 200}, "keyframes",
                    "nearest ones of the convex hull of all, in the submap");
        v.parameter("concave_hull", concave_hull, Range{0, 200}, "keyframes",
                    "nearest ones of the concave hull of all, in the submap");
        v.parameter("concave_alpha_m", concave_alpha_m, Range{0.1, 1000.0}, "m",
                    "radius of the circles that dent the concave hull");
        v.parameter("max_keyframes", max_keyframes, Range{2, 10000}, "keyframes",
                    "beyond this the farthest is forgotten");
    }
};

/// Keyframes in world coordinates, fixed point. The submap is a voxel map of the chosen ones; what changes in the
/// choice is added or taken away exactly.
class KeyframeDatabase {
  public:
    KeyframeDatabase(const KeyframeConfig& config, const VoxelMapConfig& voxels);

    /// True where a scan at this pose should become a keyframe.
    /// @param spaciousness_m median range of the scan
    bool is_due(const Eigen::Isometry3d& T_world_sensor, double spaciousness_m) const;
    /// Remembers that a keyframe is on its way, so that its neighbours do not become one too.
    /// @param covariance of its pose in the world
    void announce(const Eigen::Isometry3d& T_world_sensor, const Matrix6d& covariance);
    /// How uncertain the submap itself is, as a pose at this position: mean of the nearest keyframes.
    Matrix6d anchor_covariance(const Eigen::Vector3d& position_m) const;
    /// How much of what is seen from this position is seen anew: the way to the nearest keyframe, as a share of the
    /// distance at which there would be another one, at most 1.
    double newness(const Eigen::Vector3d& position_m, double spaciousness_m) const;
    void add(const KeyframeCloud& cloud);
    /// A stand-in for the submap while there is no keyframe yet.
    void set_provisional(const KeyframeCloud& cloud);
    void clear();
    /// Takes all points inside the box out of all keyframes.
    void remove_points(const OrientedBox& box);

    /// Chooses the submap for a sensor at this position.
    void update_submap(const Eigen::Vector3d& position_m);
    VoxelMap& submap() { return submap_; }

    std::size_t size() const { return keyframes_.size(); }
    bool empty() const { return keyframes_.empty() && provisional_.empty(); }

  private:
    /// Points that are looked over together: they lie near each other.
    static constexpr std::size_t kChunk = 64;
    struct Bounds {
        std::array<std::int32_t, 3> low, high;  ///< inclusive, fixed point
    };
    struct Keyframe {
        Eigen::Vector3d position_m;
        Eigen::Quaterniond rotation;
        std::vector<FixedPoint> points;
        std::vector<Bounds> bounds;  ///< of every kChunk points
        Matrix6d covariance;         ///< of the pose, translation and rotation, world
        std::uint8_t on_convex_hull = 0;
        std::uint8_t on_concave_hull = 0;
        bool in_submap = false;
    };

    double spacing_m(double spaciousness_m) const;
    static void convert(const KeyframeCloud& cloud, std::vector<FixedPoint>& points);
    void sort_by_place(std::vector<FixedPoint>& points);
    static void find_bounds(Keyframe& keyframe);
    void forget_farthest(const Eigen::Vector3d& position_m);
    void update_hulls();
    void choose(std::size_t most, std::uint8_t Keyframe::*wanted);

    KeyframeConfig config_;
    VoxelMap submap_;
    std::vector<Keyframe> keyframes_;
    struct Announced {
        Eigen::Isometry3d T_world_sensor;
        Matrix6d covariance;
    };
    std::vector<Announced> announced_;
    std::vector<FixedPoint> provisional_;
    bool hulls_are_old_ = false;
    std::vector<Eigen::Vector3d> positions_;                       ///< scratch of update_hulls
    std::vector<std::pair<std::uint64_t, std::uint32_t>> places_;  ///< scratch of sort_by_place
    std::vector<FixedPoint> sorted_;                               ///< scratch of sort_by_place
    std::vector<FixedPoint> removed_;                              ///< scratch of remove_points
    std::vector<std::uint8_t> chosen_;                             ///< scratch of update_submap
    std::vector<std::pair<double, std::size_t>> order_;            ///< scratch of update_submap
};

}  // namespace dlod
