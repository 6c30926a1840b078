// The turn of an upright plane about an upright axis, between an earlier frame and now.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/evidence/evidence_image.hpp"
#include "core/evidence/plan_line.hpp"
#include "core/evidence/plate_places.hpp"
#include "core/evidence/turned_plates_config.hpp"

namespace dlod {

/// A point, and what the references saw in its direction; world axes about the sensor now, m.
struct PlatePoint {
    Eigen::Vector3d now;
    std::array<Eigen::Vector3d, CandidatePoints::kShifts> before;
    std::array<bool, CandidatePoints::kShifts> known;
};

struct PlateTurn {
    PlanLine now, before;
    double turn_rad = 0.0;
    double hinge_m = 0.0;             ///< the axis, along `now`
    double from_m = 0.0, to_m = 0.0;  ///< extent along `now`
    double low_m = 0.0, high_m = 0.0;

    double length_m() const { return to_m - from_m; }
    /// By how much the end has moved that is farther from the axis.
    double far_shift_m() const;
    /// What seems to have shifted by more was seen past the plate's end.
    double most_shift_m(double tolerance_m) const;
    /// Whether the axis is at the plate, or not far beyond its ends.
    bool is_hinged() const;
    /// Whether a point is of the plate, and in its half that moves more.
    bool is_far_from_axis(const Eigen::Vector3d& point, double tolerance_m) const;
};

class PlateTurnFit {
  public:
    PlateTurnFit(const TurnedPlatesConfig& config, std::size_t most_points);

    /// The turn of the plane that the points at a place lie in, since a reference; none that the noise could feign, and
    /// no plate of another size than is looked for. Its heights are left at 0.
    std::optional<PlateTurn> find(std::span<const PlatePoint> points, const PlatePlace& place, std::size_t reference);

  private:
    /// What is looked at.
    struct Window {
        std::span<const PlatePoint> points;
        std::size_t reference;
        double low_m, high_m;
        double reach_m;
        int side;  ///< as of the place
    };

    bool fit_planes(const Window& window, PlateTurn& turn);
    void find_ends(const Window& window, const Eigen::Vector2d& anchor, PlateTurn& turn) const;
    bool is_significant(const PlateTurn& turn) const;

    TurnedPlatesConfig config_;
    std::vector<Eigen::Vector2d> formers_;
};

}  // namespace dlod
