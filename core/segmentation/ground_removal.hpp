// Coarse ground removal on the range image (paper, Sec. "Range Image-based Segmentation", after LeGO-LOAM).
//
// Each image column is walked from the lowest beam outwards while a line filter (height and slope) follows the ground:
// a return is ground when it continues that line. Slopes, ramps and kerbs are followed, walls, legs, roofs and ceilings
// are not; all columns advance together, row by row.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct GroundRemovalConfig {
    double max_slope_rad = 0.1745;
    double height_tolerance_m = 0.05;
    double slope_tolerance = 0.05;
    double max_step_m = 0.35;
    double min_sensor_height_m = 0.25;
    double max_sensor_height_m = 3.5;
    double min_range_m = 0.5;

    template <class V>
    void visit(V& v) {
        v.parameter("max_slope_rad", max_slope_rad, Range{0.01, 0.8}, "rad",
                    "steepest slope between vertical neighbours that still counts as ground");
        v.parameter(
            "height_tolerance_m", height_tolerance_m, Range{0.01, 0.5}, "m",
            "height above the followed ground up to which a return is ground; higher eats feet, lower leaves grass");
        v.parameter("slope_tolerance", slope_tolerance, Range{0.0, 0.5}, "1",
                    "growth of that tolerance per metre since the last ground return of the column");
        v.parameter("max_step_m", max_step_m, Range{0.05, 1.0}, "m", "bound of the grown tolerance");
        v.parameter("min_sensor_height_m", min_sensor_height_m, Range{0.05, 10.0}, "m",
                    "lowest mounting height looked for");
        v.parameter("max_sensor_height_m", max_sensor_height_m, Range{0.1, 20.0}, "m",
                    "greatest mounting height looked for");
        v.parameter("min_range_m", min_range_m, Range{0.0, 10.0}, "m",
                    "nearer returns (the robot itself) are never ground");
    }
};

/// Fills frame.prepared.ground from frame.cloud. The vertical is the normal of the ground around the robot, which
/// hardly turns with respect to the sensor and is not deceived by braking; at the start, and where too little ground is
/// seen, it is that of the accelerometer over some seconds, without IMU the sensor's z axis. Needs no pose.
class GroundRemoval {
  public:
    GroundRemoval(const SensorModel& sensor, const GroundRemovalConfig& config);
    void process(Frame& frame);

    /// Height of the sensor above the ground around it, metres, as found in the last frame.
    double sensor_height_m() const { return sensor_height_m_; }
    /// Unit vector away from the ground, sensor frame, as used in the last frame.
    const Eigen::Vector3f& up() const { return up_; }

  private:
    void update_gravity(const Frame& frame);
    /// Turns the vertical to the normal of the ground around; to gravity where there is too little ground.
    void update_up(const Frame& frame);
    void follow_ground(Frame& frame);
    void update_sensor_height(const StructuredCloud& cloud);
    /// Rows above this one look too far up to see ground.
    int top_row() const;

    SensorModel sensor_;
    GroundRemovalConfig config_;
    Eigen::Vector3f gravity_up_ = Eigen::Vector3f::UnitZ();  ///< from the accelerometer, over seconds
    bool started_ = false;                                   ///< gravity_up_ is known
    bool settled_ = false;                                   ///< up_ is that of ground
    Eigen::Vector3f up_ = Eigen::Vector3f::UnitZ();
    double sensor_height_m_ = 0.0;
    /// Of the row at hand and those that its slopes are taken to, [kRows][W]: horizontal distance from the sensor (0:
    /// no return, or too near) and height along up_.
    static constexpr int kRows = 3;
    Image<float> distance_, height_;
    AlignedVector<float> line_distance_, line_height_, line_slope_, line_started_;  ///< [W] the columns' line filters
    AlignedVector<float> wall_rise_;  ///< [H] difference of the beams' tangents to the row that slopes are taken to
    Image<float> sampled_distance_, sampled_height_;  ///< likewise of every few columns, [kRows]
    AlignedVector<int> histogram_;
    std::vector<Eigen::Vector3f> around_;  ///< sample of the ground around: two level axes and along up_
};

}  // namespace dlod
