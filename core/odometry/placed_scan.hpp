// A scan in the world.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>

#include "core/map/voxel_map.hpp"
#include "core/odometry/feedback.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/moving_points.hpp"
#include "core/registration/placed_points.hpp"
#include "core/registration/sweep_motion.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// A scan's points after the motion of its sweep, in a local frame: the world moved to the lower corner of a voxel near
/// the sensor, so that single precision suffices. Those that take part in a registration come first.
class PlacedScan {
  public:
    /// Another scan, none of whose points is left out yet.
    /// @param points stay the caller's, unchanged while this scan is in use
    /// @param duration_s from the first column to the stamp
    void begin(const PointSelection& points, std::int64_t stamp_ns, double duration_s);
    /// The local frame for a sensor about here; the points have to be placed anew.
    void choose_origin(const Eigen::Vector3d& position_m, double voxel_m);
    /// The local frame of another scan.
    void share_origin(const PlacedScan& other);

    /// The motion over the sweep as the filter, at the stamp, sees it; places the points that take part after it.
    void move(const MotionFilter& filter);
    /// The same for all points.
    void move_all(const MotionFilter& filter);
    /// Places the other points, too, after the last motion.
    void place_all();

    /// Points that moving objects claim weigh nothing from now on.
    void leave_out(const MovingPoints& moving);

    std::int64_t stamp_ns() const { return stamp_ns_; }
    const PointSelection& points() const { return *points_; }
    const PlacedPoints& placed() const { return placed_; }
    const SweepMotion& motion() const { return motion_; }
    VoxelIndex origin() const { return origin_; }
    const Eigen::Vector3d& origin_m() const { return origin_m_; }
    /// By point that takes part, 1: weighs nothing.
    std::span<const std::uint8_t> left_out() const { return left_out_; }
    /// The point may find a counterpart: it weighs something, and no moving object claims it.
    bool takes_part(std::size_t i) const { return points_->planarity[i] > 0.0F && left_out_[i] == 0; }
    /// Points that may find a counterpart.
    std::size_t candidates() const;
    /// Smoothed points of surfaces: what makes a scan worth beginning with.
    std::size_t flat_points() const;
    /// All points of the scan, which have to be placed.
    KeyframeCloud cloud() const;

  private:
    const PointSelection* points_ = nullptr;
    std::int64_t stamp_ns_ = 0;
    double duration_s_ = 0.1;
    SweepMotion motion_;
    PlacedPoints placed_;
    VoxelIndex origin_;
    Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
    AlignedVector<std::uint8_t> left_out_;
};

}  // namespace dlod
