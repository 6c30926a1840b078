// How well the motion of matched tracks is known: errors of velocity and heading over the objects' speed.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "core/types/track.hpp"

namespace dlod::tools {

/// Errors of the tracks whose objects move at such a speed, in the ground plane.
struct MotionErrorRow {
    double from_mps = 0.0, to_mps = 0.0;
    int samples = 0;
    std::optional<double> velocity_median_mps, velocity_p90_mps;  ///< length of the difference of the velocities
    std::optional<double> speed_bias_mps;                         ///< mean of the tracks' speed less the true one
    std::optional<double> heading_median_deg, heading_p90_deg;    ///< angle between the velocities

    template <class V>
    void visit(V& v) const {
        v("from_mps", from_mps);
        v("to_mps", to_mps);
        v("samples", samples);
        v("velocity_median_mps", velocity_median_mps);
        v("velocity_p90_mps", velocity_p90_mps);
        v("speed_bias_mps", speed_bias_mps);
        v("heading_median_deg", heading_median_deg);
        v("heading_p90_deg", heading_p90_deg);
    }
};

/// Value below which the share `q` of the sorted values lies, interpolated; nothing without values.
std::optional<double> quantile(const std::vector<double>& sorted, double q);

class MotionErrors {
  public:
    /// @param velocity_mps, true_mps of a track and its object, ground plane of the same world
    void add(const Eigen::Vector2d& velocity_mps, const Eigen::Vector2d& true_mps);

    /// One row for slow motion, walking, running and cycling, driving, and one for everything.
    std::vector<MotionErrorRow> table() const;

    /// Mean errors of all; heading only above 0.5 m/s.
    std::optional<double> mean_velocity_mps() const;
    std::optional<double> mean_heading_deg() const;

  private:
    struct Sample {
        double speed_mps, velocity_error_mps, speed_error_mps, heading_error_deg;
    };
    MotionErrorRow row(double from_mps, double to_mps) const;

    std::vector<Sample> samples_;
};

}  // namespace dlod::tools
