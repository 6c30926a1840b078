// First stage of the registration: the scan against the one before (paper, Sec. "Overview").
//
// Counterparts come from projection, not from a tree: the points of the previous scan lie in a grid of directions as
// seen from its sensor (Eq. 1, by angle, as they have been deskewed), and a point looks into the cell that it projects
// to.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "core/registration/normal_equations.hpp"
#include "core/registration/placed_points.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct ScanToScanConfig {
    int points = 600;
    int iterations = 3;
    double gate_m = 1.0;
    double min_normal_cosine = 0.8;

    template <class V>
    void visit(V& v) {
        v.parameter("points", points, Range{100, 20000}, "points", "flat points of the scan that take part");
        v.parameter("iterations", iterations, Range{0, 50}, "", "at most this many; it stops at 1 mm and 1e-4 rad");
        v.parameter("gate_m", gate_m, Range{0.05, 10.0}, "m", "farther counterparts are not believed");
        v.parameter("min_normal_cosine", min_normal_cosine, Range{0.0, 1.0}, "",
                    "least cosine between the normals of the two points");
    }
};

class ScanToScan {
  public:
    explicit ScanToScan(const ScanToScanConfig& config);

    /// Keeps the flat points of a registered scan as the next one's target.
    /// @param excluded by point, 1: left out, as are points beyond its end; empty: none is
    /// @param placed the points in that scan's local frame
    /// @param T_sensor_local sends that frame into the sensor's at the stamp
    void set_target(const PointSelection& points, std::span<const std::uint8_t> excluded, const PlacedPoints& placed,
                    const Eigen::Isometry3f& T_sensor_local);
    void clear_target() { filled_ = false; }
    bool has_target() const { return filled_; }

    /// @param placed the points in this scan's local frame
    /// @param T_target_local sends local coordinates into the sensor frame at the target's stamp
    void match(const PointSelection& points, std::span<const std::uint8_t> excluded, const PlacedPoints& placed,
               const Eigen::Isometry3f& T_target_local, double widening, PlaneMatches& matches) const;

  private:
    static constexpr int kColumns = 256;
    static constexpr int kRows = 90;  ///< 2 degrees each, from straight down to straight up

    struct Surfel {
        float position[3];
        float normal[3];
        bool set = false;
    };
    static int cell_of(const float p[3]);

    ScanToScanConfig config_;
    std::vector<Surfel> grid_;
    std::vector<int> set_;  ///< cells of it
    bool filled_ = false;
};

}  // namespace dlod
