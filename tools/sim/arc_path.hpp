// A path in the plane, measured along its length.
#pragma once

#include <vector>

#include "tools/sim/mesh.hpp"

namespace dlod::tools::sim {

/// A polyline with rounded corners, sampled densely. An open path goes on straight beyond its ends; on a closed one
/// lengths wrap.
class ArcPath {
  public:
    ArcPath() = default;
    /// `corner_m`: how far from a corner the rounding begins, about.
    ArcPath(const std::vector<Vec2>& corners, bool closed, double corner_m = 1.0);

    double length_m() const { return length_m_; }
    bool closed() const { return closed_; }
    Vec2 point(double s) const;
    /// Direction of travel, rad, without jumps along the path (it goes on growing over the turns of a closed one).
    double heading(double s) const;
    /// 1/m, without sign.
    double curvature(double s) const;
    /// Distance of a point to the nearest point of the path.
    double distance_m(const Vec2& p) const;

  private:
    double at(const std::vector<double>& values, double s) const;

    bool closed_ = false;
    double length_m_ = 0.0;
    double step_m_ = 0.05;
    double turn_rad_ = 0.0;  ///< heading gained over a whole turn of a closed path
    std::vector<double> x_, y_, heading_;
};

}  // namespace dlod::tools::sim
