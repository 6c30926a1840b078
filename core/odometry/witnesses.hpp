// Which surfaces of a scan speak for where it has been placed.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/odometry/placed_scan.hpp"
#include "core/registration/normal_equations.hpp"

namespace dlod {

/// Upright surfaces tell a motion over the ground, each along the direction that it faces in the plan. Points whose own
/// normal is not known find a surface anywhere and say nothing; a point's own normal decides where it faces, as a plane
/// of the map is tilted at random where it lies on an edge.
class Witnesses {
  public:
    /// @param matches of the scan as it is placed
    Witnesses(const PlacedScan& scan, const PlaneMatches& matches);

    /// Nearly all of the scan lies where the map has it, as a whole and by its surfaces of every direction: in a
    /// street, facades and ground look the same from everywhere, and only the little that faces along it tells a
    /// motion.
    /// @param least_points that face a direction make it count
    bool see_the_same(double least_points) const;
    /// Where a single thing, no larger than a vehicle, is all that speaks for the motion along some direction, that
    /// thing may be what moves: it takes others to tell. Without the one that speaks most, enough of what faces that
    /// direction has to lie where the map has it.
    /// @param before of the scan that the map was made of: what it could find again
    bool are_more_than_one_body(const Witnesses& before) const;

  private:
    struct Point {
        float x, y;    ///< local frame
        float nx, ny;  ///< normal in the plan
        bool found;    ///< it lies where the map has it
    };
    std::vector<Point> facing(const Eigen::Vector2f& direction) const;

    std::vector<Point> points_;  ///< flat points
};

}  // namespace dlod
