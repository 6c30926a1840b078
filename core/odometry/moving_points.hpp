// Points that tracked objects claim: they weigh nothing in the registration.
#pragma once

#include <span>
#include <vector>

#include "core/odometry/feedback.hpp"
#include "core/registration/placed_points.hpp"

namespace dlod {

class MovingPoints {
  public:
    /// @param boxes as they were at `stamp_ns`
    void set(std::span<const MovingBox> boxes, std::int64_t stamp_ns);

    /// Sets excluded to 1 for each point inside a box, moved on to the frame's stamp.
    /// @param placed local frame: the world moved to origin_m
    void mark(const PlacedPoints& placed, const Eigen::Vector3d& origin_m, std::int64_t stamp_ns,
              std::span<std::uint8_t> excluded) const;

  private:
    std::vector<MovingBox> boxes_;
    std::int64_t stamp_ns_ = 0;
};

}  // namespace dlod
