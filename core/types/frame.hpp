// One turn of the sensor and everything that the stages have found out about it.
//
// A Frame is allocated once, lives in a pool and is handed from stage to stage; each stage writes its own part and
// reads the earlier ones. Images are destaggered, row-major, row 0 the top beam; the pixel (r, c) was fired in column
// SensorModel::measurement_of(r, c). Arrays "by measurement" are in firing order.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/types/image.hpp"
#include "core/types/imu_sample.hpp"
#include "core/types/lie.hpp"
#include "core/types/sensor_model.hpp"
#include "core/types/track.hpp"

namespace dlod {

/// Written by the frame builder.
struct FrameHeader {
    std::uint64_t sequence = 0;       ///< counts frames from 0, also those dropped for want of a free one
    std::uint32_t frame_id = 0;       ///< the sensor's own, wraps
    std::int64_t stamp_ns = 0;        ///< sensor time of the last valid column: the frame's pose refers to it
    std::int64_t first_stamp_ns = 0;  ///< sensor time of the first valid column
    /// Host time (CLOCK_REALTIME) of the packet that completed it, capture time in replay.
    std::int64_t receive_ns = 0;
    int valid_columns = 0;
    bool usable = false;  ///< enough valid columns for odometry
};

/// Written by the frame builder, pixel by pixel as packets arrive; 0 where nothing was returned.
struct RawImages {
    Image<std::uint32_t> range_mm;  ///< from the beam's origin, as the sensor reports it
    Image<std::uint8_t> reflectivity;
    Image<std::uint16_t> signal;
    Image<std::uint16_t> near_ir;
};

/// Written by the frame builder, by measurement.
struct Columns {
    std::vector<std::int64_t> time_ns;  ///< [W] sensor time; 0 where the column was lost
    std::vector<std::uint32_t> status;  ///< [W] as sent
    std::vector<std::uint8_t> valid;    ///< [W] 1 where the column arrived and is valid
};

/// Written by the geometry: each pixel's point in the sensor frame at the moment its column was fired.
struct StructuredCloud {
    Image<float> range_m;  ///< distance from the sensor origin (Eq. 2); 0: no return
    Image<float> x, y, z;  ///< metres; 0, 0, 0 where there is no return
};

/// Points taken out of the image, with their pixels (structure of arrays).
struct PointSelection {
    AlignedVector<PixelIndex> pixel;
    AlignedVector<std::uint16_t> measurement;  ///< column in which it was fired
    AlignedVector<float> x, y, z;              ///< sensor frame at firing time, metres
    AlignedVector<float> nx, ny, nz;  ///< unit normal towards the sensor, from the range-image window; 0, 0, 0: unknown
    AlignedVector<float> planarity;   ///< weight in the registration: 1 flat .. 0 no part in it
    AlignedVector<float> time_s;      ///< firing time relative to the frame's stamp, at most 0
    AlignedVector<float> tx, ty, tz;  ///< gradient of that time over the window that the normal is from, s/m
    std::size_t size() const { return pixel.size(); }
    /// It lies on a surface whose normal is known; a raw point has none.
    bool is_flat(std::size_t i) const { return nx[i] != 0.0F || ny[i] != 0.0F || nz[i] != 0.0F; }
    void clear() {
        pixel.clear();
        measurement.clear();
        for (auto* v : {&x, &y, &z, &nx, &ny, &nz, &planarity, &time_s, &tx, &ty, &tz}) v->clear();
    }
};

/// Written by the preparation, which needs no pose.
struct Preparation {
    Image<std::uint8_t> ground;    ///< 1 where the pixel belongs to the ground
    Image<std::uint32_t> segment;  ///< 1 + index into segments, 0: none (ground, no return, too far)
    std::vector<Segment> segments;
    std::vector<PixelIndex> pixels;  ///< of all segments, grouped by segment
    PointSelection points;           ///< input of the registration
};

/// Where the sensor is and how it moves at some moment.
struct SensorMotion {
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    Eigen::Vector3d linear_velocity_mps = Eigen::Vector3d::Zero();     ///< sensor frame
    Eigen::Vector3d angular_velocity_radps = Eigen::Vector3d::Zero();  ///< sensor frame
    Matrix6d covariance = Matrix6d::Zero();  ///< of translation, then rotation, world; as in OdometryResult
};

/// What the IMU's readings carry a motion on with.
struct ImuCorrection {
    Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();                         ///< IMU frame
    Eigen::Vector3d accelerometer_bias_mps2 = Eigen::Vector3d::Zero();                 ///< IMU frame
    Eigen::Vector3d gravity_mps2 = Eigen::Vector3d(0.0, 0.0, -kStandardGravity_mps2);  ///< world frame
    Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();  ///< of the sensor's velocity, world axes
};

/// Written by the odometry.
struct OdometryResult {
    enum Flag : std::uint32_t {
        kImuUsed = 1U << 0,        ///< rotation and gravity came from the IMU
        kDegenerate = 1U << 1,     ///< at least one direction was not observable and is held by prediction
        kPredictedOnly = 1U << 2,  ///< too few columns or no convergence: the pose is the prediction
        kReinitialized = 1U << 3,  ///< a new map: after it was lost, or with the first pose once the level is known
        kImuFaulty = 1U << 4,      ///< the IMU is there but absurd and is not used
        kStarted = 1U << 5,        ///< the world frame begins anew: first frame of a run, or after a restart
    };
    /// Registered with the local map, or predicted, to within OdometryConfig::max_deviation_m in every direction: fit
    /// for planning around what is seen now. False: not to be used, not written, published with its flag. It says
    /// nothing of the way from the world's origin: that is what the covariance is for.
    bool valid = false;
    /// It would be valid, had scans shown already that the local map is where the robot is (without IMU).
    bool in_doubt = false;
    std::uint32_t flags = 0;
    /// Good enough for seeing what moves: valid, or in doubt only for where the map is, or else registered with the
    /// local map but adrift along a direction in which nothing is to be seen.
    bool follows_map() const { return valid || in_doubt || (flags & (kDegenerate | kPredictedOnly)) == kDegenerate; }
    /// What earlier frames saw does not fit this one: a new map, or one whose first scan is void.
    bool earlier_is_void() const { return (flags & kReinitialized) != 0 || void_scan_ns.has_value(); }
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();  ///< at the frame's stamp
    Eigen::Vector3d linear_velocity_mps = Eigen::Vector3d::Zero();     ///< sensor frame
    Eigen::Vector3d angular_velocity_radps = Eigen::Vector3d::Zero();  ///< sensor frame
    /// Of translation (world), then rotation (world, small angles), against the world frame as the first pose has fixed
    /// it: grows with the way. How well that frame is levelled is not in it.
    Matrix6d covariance = Matrix6d::Zero();
    ImuCorrection imu;  ///< without IMU (see kImuUsed) gravity alone counts
    SensorMotion motion() const { return {T_world_sensor, linear_velocity_mps, angular_velocity_radps, covariance}; }
    int iterations = 0;
    int correspondences = 0;
    bool keyframe = false;  ///< becomes a keyframe once its moving points have been removed
    /// Stamp of the scan that the map began with, where it turns out to have been deskewed for another motion than it
    /// had: nothing that was learnt from it holds.
    std::optional<std::int64_t> void_scan_ns;
    /// Residuals of the scan-to-submap registration: distance of each registered point to its counterpart.
    AlignedVector<PixelIndex> residual_pixel;
    AlignedVector<float> residual_m;
    float residual_cap_m = 0.0F;  ///< what residual_m says where nothing of the submap is near
    /// Rows of T_stamp_column by measurement: turns a point of StructuredCloud into the sensor frame at the stamp.
    AlignedVector<float> deskew[12];  ///< row-major 3 x 4, each [W]
    /// Of a keyframe: position and normal (x, y, z, nx, ny, nz) of Preparation::points, deskewed, sensor frame at the
    /// stamp.
    std::array<AlignedVector<float>, 6> keyframe_points;
    /// The deskewed cloud: sensor frame at the stamp; 0, 0, 0 where there is no return.
    Image<float> x, y, z;
};

/// Written by detection and tracking.
struct DetectionResult {
    std::vector<PixelIndex> pixels;  ///< of all detections, grouped by detection
    /// Of each of them: 1 where earlier frames saw free space, -1 where they saw a surface, else 0. Empty without
    /// free-space evidence.
    std::vector<std::int8_t> motion;
    std::vector<Detection> detections;
    std::vector<Track> tracks;      ///< seen in, or predicted for, this frame
    Image<std::uint8_t> label;      ///< PixelLabel
    Image<std::uint32_t> instance;  ///< track id, 0 none
    int dynamic_points = 0;
    std::vector<OrientedBox>
        cleared;  ///< boxes whose past is to be cleared from the maps (Sec. "Dynamic Points Removal")

    /// No detections and no tracks.
    void clear() {
        pixels.clear();
        motion.clear();
        detections.clear();
        tracks.clear();
        cleared.clear();
        dynamic_points = 0;
    }
};

struct Frame {
    bool restart = false;  ///< set before the first step: the method begins anew with this frame
    FrameHeader header;
    RawImages raw;
    Columns columns;
    std::vector<ImuSample> imu;  ///< samples that came since the frame before, in time order
    StructuredCloud cloud;
    Preparation prepared;
    OdometryResult odometry;
    DetectionResult detection;

    /// Allocates everything for a sensor; afterwards no stage needs to allocate.
    explicit Frame(const SensorModel& sensor);
};

}  // namespace dlod
