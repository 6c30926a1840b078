// What the odometry knows, and the steps of a frame. The steps are in three files: the course of a frame, starts and
// restarts (odometry.cpp), its registration (frame_registration.cpp), and what is said of it (odometry_result.cpp).
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/map/keyframe_database.hpp"
#include "core/odometry/held_directions.hpp"
#include "core/odometry/imu_buffer.hpp"
#include "core/odometry/imu_monitor.hpp"
#include "core/odometry/motion_filter.hpp"
#include "core/odometry/moving_points.hpp"
#include "core/odometry/odometry.hpp"
#include "core/odometry/start_level.hpp"
#include "core/registration/placed_points.hpp"
#include "core/registration/scan_to_scan.hpp"
#include "core/registration/scan_to_submap.hpp"

namespace dlod {

struct Odometry::State {
    State(const SensorModel& sensor_model, const OdometryConfig& configuration);

    void process(Frame& frame, const OdometryFeedback* feedback);

  private:
    static constexpr double kMaxSweep_s = 0.5;
    static constexpr double kClockOffset_s = 1e-3;  ///< that the clocks of IMU and lidar may have

    void apply(const OdometryFeedback& feedback);
    void start(const Frame& frame, const Eigen::Isometry3d& T_world_sensor);
    void restart(const Frame& frame, const Matrix6d& moved);
    static std::size_t taking_part(const PointSelection& points);
    static std::size_t flat_points(const Frame& frame);
    bool estimate(const Frame& frame);
    void accept();
    bool find_again(const Frame& frame);
    void choose_motion_model(const Frame& frame);
    bool imu_is_consistent();
    void retry_without_imu(const Frame& frame, const MotionFilter& before, bool absurd);
    void use_constant_velocity();
    void bootstrap(const Frame& frame);
    void register_frame(const Frame& frame, int first_stage_iterations, double widening);
    MotionFilter likeliest_start(const Frame& frame, const MotionFilter& unmoved);
    void settle(const Frame& frame, int passes, int iterations_a_pass);
    void begin_again(const Frame& frame);
    double predicted_deviation_m() const;
    bool sees_the_same(const PointSelection& points) const;
    double fit() const;
    bool first_scan_is_void() const;
    void place_provisional();
    void level(const Frame& frame);
    void renew_map(const Frame& frame);
    void begin_world(const Frame& frame, const StartLevel::Gravity& gravity);
    bool is_trustworthy();
    bool is_beside_its_map(const PointSelection& points) const;
    void see_uncertainty();
    Matrix6d prediction_covariance() const;
    void choose_origin();
    void update_sweep(const Frame& frame);
    void place_target(const PointSelection& points, std::span<const std::uint8_t> without,
                      const Eigen::Isometry3d& T_world_sensor);
    void see_motion(const Frame& frame);
    void update_anchor(const Eigen::Vector3d& position_m);
    Matrix6d covariance_in_world(const Eigen::Vector3d& position_m, double range_m, const Matrix6d& deviation);
    void write_result(Frame& frame);
    void write_keyframe_points(Frame& frame) const;
    void write_nothing(Frame& frame) const;
    static Eigen::Vector3d specific_force(const Frame& frame);
    static Eigen::Vector3d mean_force(const Frame& frame);
    double median_range(const PointSelection& points);

    SensorModel sensor;
    OdometryConfig config;
    ImuBuffer imu;
    ImuMonitor monitor;
    MotionFilter filter;
    KeyframeDatabase keyframes;
    ScanToScan scan_to_scan;
    ScanToSubmap scan_to_submap;
    MovingPoints moving;

    bool started = false;
    bool gravity_known = false;        ///< the world is level, or the IMU has told how it is not
    std::uint64_t world_sequence = 0;  ///< of the frame that the world began with
    std::uint64_t map_sequence = 0;    ///< of the frame that the map began with
    bool bootstrapping = false;        ///< the map is one scan that has not been deskewed for its velocity
    MotionFilter first_filter;         ///< while bootstrapping: at the stamp of that scan
    PointSelection first_points;       ///< while bootstrapping: of that scan
    double first_duration_s = 0.0;     ///< while bootstrapping: of that scan
    MotionState first_motion;          ///< while bootstrapping: that it was published with
    bool level_known = true;           ///< false: in motion since it started, and where down is does not show yet
    int scans_since_start = 0;         ///< registered ones, while the level is not known
    int retries = 0;                   ///< of the start, because it did not fit the accelerometer
    StartLevel start_level;
    HeldDirections held;
    std::int64_t last_registered_ns = 0;
    std::int64_t searched_ns = 0;           ///< stamp of the last search around the prediction
    Matrix6d from_scan = Matrix6d::Zero();  ///< covariance of the last registration, the map being right
    Matrix6d lag = Matrix6d::Zero();        ///< mean square of what the filter has not followed of late, without IMU
    Matrix6d from_map = Matrix6d::Zero();   ///< what the map's errors add where it is seen from elsewhere
    Matrix6d anchor = Matrix6d::Zero();     ///< covariance of what the pose is relative to
    Matrix6d start_covariance = Matrix6d::Zero();                         ///< of the pose that the map began with
    std::int64_t start_ns = 0;                                            ///< stamp of that pose
    Eigen::Vector3d start_position_m = Eigen::Vector3d::Zero();           ///< of that pose
    Eigen::Isometry3d T_world_target = Eigen::Isometry3d::Identity();     ///< pose of the first stage's target scan
    std::int64_t target_ns = 0;                                           ///< its stamp
    Eigen::Quaterniond target_rotation = Eigen::Quaterniond::Identity();  ///< of the body
    Eigen::Vector3d target_velocity_mps = Eigen::Vector3d::Zero();        ///< of the body, world
    Eigen::Vector3d lidar_rate_radps = Eigen::Vector3d::Zero();  ///< body, between the last two registered scans

    // Of the present frame.
    std::uint32_t flags = 0;
    bool registered = false;
    bool just_started = false;                 ///< the map began with this frame
    bool trusted = true;                       ///< false: what this frame gives is not to be used
    std::optional<std::int64_t> void_scan_ns;  ///< as in the result
    SweepMotion motion;
    PlacedPoints placed;  ///< the frame's points after that motion
    VoxelIndex origin;
    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
    std::size_t candidates = 0;  ///< points that might have found a counterpart
    std::size_t near = 0;        ///< matches that lie on their planes
    double usual_near = 0.0;     ///< the same over the last frames
    double usual_fit = 0.0;      ///< what speaks for the motion over the ground, over the last frames
    PlaneMatches matches;
    NormalEquations equations;
    SurfaceInformation surface_information;
    AlignedVector<std::uint8_t> excluded;
    std::vector<float> ranges;
    double spaciousness_m = 0.0;
    int iterations = 0;
    Vector6d last_step = Vector6d::Zero();  ///< of the filter: translation, rotation
};

}  // namespace dlod
