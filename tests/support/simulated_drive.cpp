#include "tests/support/simulated_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/lie.hpp"

namespace dlod::test {
namespace {

constexpr double kImuPeriod_s = 0.01;
constexpr double kPi = std::numbers::pi;

}  // namespace

std::vector<SceneBox> furnished_room() {
    return {{{-8, -7, -1}, {12, 9, 4}, true},    {{3, 2, -1}, {3.6, 2.6, 4}},     {{-4, -3, -1}, {-3.5, -2.4, 4}},
            {{6, -5, -1}, {7.5, -4, 0.5}},       {{-6, 5, -1}, {-4, 6, 1}},       {{8, 5, -1}, {9, 8.9, 2.5}},
            {{-7.9, -6.9, -1}, {-6.5, -5, 1.5}}, {{1, -6.9, -1}, {1.4, -4.5, 4}}, {{10, -2, -1}, {11, 0.5, 1}},
            {{0.5, 6.5, -1}, {2, 8.5, 0.2}}};
}

SimulatedDrive::SimulatedDrive(std::vector<SceneBox> scene, Trajectory trajectory, const DriveOptions& options)
    : scene_(std::move(scene)), trajectory_(std::move(trajectory)), options_(options), random_(options.seed) {
    sensor_.height = options.height;
    sensor_.width = options.width;
    sensor_.column_window_last = options.width - 1;
    sensor_.frame_period_s = options.period_s;
    sensor_.beam_origin_m = 0.0277F;
    moving_.resize(options.height, options.width);
    for (int r = 0; r < options.height; ++r) {
        const double altitude = kPi / 4.0 - kPi / 2.0 * (r + 0.5) / options.height;
        sensor_.altitude_rad.push_back(static_cast<float>(altitude));
        // Four staggered columns of emitters, as in the real sensor.
        const int shift = 3 + 6 * (3 - r % 4);
        sensor_.pixel_shift.push_back(shift);
        sensor_.azimuth_offset_rad.push_back(static_cast<float>((shift - 12.3) * 2.0 * kPi / options.width));
    }
    sensor_.T_sensor_lidar.linear() = Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    sensor_.T_sensor_lidar.translation() = Eigen::Vector3d(0.0, 0.0, 0.036);
    sensor_.T_sensor_imu.translation() = Eigen::Vector3d(0.006, -0.012, 0.008);
}

double SimulatedDrive::stamp_s(int k) const {
    return (k + static_cast<double>(options_.width - 1) / options_.width) * options_.period_s;
}

SimulatedDrive::Hit SimulatedDrive::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& d, double time_s) const {
    Hit best{options_.max_range_m, false};
    for (const SceneBox& box : scene_) {
        double enter = -1e9;
        double leave = 1e9;
        for (int i = 0; i < 3; ++i) {
            const double inverse = 1.0 / (std::abs(d[i]) > 1e-12 ? d[i] : 1e-12);
            const double a = (box.low[i] + box.velocity[i] * time_s - origin[i]) * inverse;
            const double b = (box.high[i] + box.velocity[i] * time_s - origin[i]) * inverse;
            enter = std::max(enter, std::min(a, b));
            leave = std::min(leave, std::max(a, b));
        }
        if (leave < enter) continue;
        const double hit = box.inside ? leave : enter;
        if (hit > 0.05 && hit < best.distance) best = {hit, !box.velocity.isZero()};
    }
    return best.distance < options_.max_range_m ? best : Hit{};
}

ImuSample SimulatedDrive::imu_at(double t) {
    constexpr double h = 1e-4;
    const auto imu_pose = [&](double time) { return trajectory_(time) * sensor_.T_sensor_imu; };
    const Eigen::Isometry3d before = imu_pose(t - h);
    const Eigen::Isometry3d now = imu_pose(t);
    const Eigen::Isometry3d after = imu_pose(t + h);
    const Eigen::Vector3d rate =
        so3_log(Eigen::Quaterniond(before.rotation()).conjugate() * Eigen::Quaterniond(after.rotation())) / (2.0 * h);
    const Eigen::Vector3d acceleration =
        (after.translation() - 2.0 * now.translation() + before.translation()) / (h * h);
    const Eigen::Vector3d force = now.rotation().transpose() * (acceleration + Eigen::Vector3d(0.0, 0.0, 9.80665));
    const auto noise = [&](double deviation) {
        return Eigen::Vector3d(deviation * normal_(random_), deviation * normal_(random_),
                               deviation * normal_(random_));
    };
    ImuSample sample;
    sample.stamp_ns = kEpoch_ns + std::llround(t * 1e9);
    sample.angular_velocity_radps = (rate + options_.gyro_bias_radps + noise(options_.gyro_noise_radps)).cast<float>();
    sample.acceleration_mps2 =
        (force + options_.accelerometer_bias_mps2 + noise(options_.accelerometer_noise_mps2)).cast<float>();
    return sample;
}

void SimulatedDrive::fill(int k, Frame& frame) {
    const int h = sensor_.height;
    const int w = sensor_.width;
    frame.header = FrameHeader{};
    frame.header.sequence = static_cast<std::uint64_t>(k);
    frame.header.frame_id = static_cast<std::uint32_t>(k);
    frame.imu.clear();
    while (next_imu_s_ < stamp_s(k)) {
        ImuSample sample = imu_at(next_imu_s_);
        next_imu_s_ += kImuPeriod_s;
        if (!options_.imu) continue;
        if (spoil_imu) spoil_imu(sample);
        frame.imu.push_back(sample);
    }
    frame.raw.range_mm.fill(0);
    moving_.fill(0);
    for (auto* image : {&frame.cloud.range_m, &frame.cloud.x, &frame.cloud.y, &frame.cloud.z}) image->fill(0.0F);
    const double n = static_cast<double>(sensor_.beam_origin_m);
    for (int m = 0; m < w; ++m) {
        const auto column = static_cast<std::size_t>(m);
        const double time = (k + static_cast<double>(m) / w) * options_.period_s;
        const bool arrives = !column_arrives || column_arrives(k, m);
        frame.columns.valid[column] = arrives ? 1 : 0;
        frame.columns.status[column] = arrives ? 1 : 0;
        frame.columns.time_ns[column] = arrives ? kEpoch_ns + std::llround(time * 1e9) : 0;
        if (!arrives) continue;
        if (frame.header.valid_columns++ == 0) frame.header.first_stamp_ns = frame.columns.time_ns[column];
        frame.header.stamp_ns = frame.columns.time_ns[column];
        const Eigen::Isometry3d T_world_sensor = trajectory_(time);
        const Eigen::Isometry3d T_world_lidar = T_world_sensor * sensor_.T_sensor_lidar;
        const double theta = 2.0 * kPi * (1.0 - static_cast<double>(m) / w);
        for (int r = 0; r < h; ++r) {
            const auto row = static_cast<std::size_t>(r);
            const double a = theta - static_cast<double>(sensor_.azimuth_offset_rad[row]);
            const double p = static_cast<double>(sensor_.altitude_rad[row]);
            const Eigen::Vector3d direction(std::cos(a) * std::cos(p), std::sin(a) * std::cos(p), std::sin(p));
            const Eigen::Vector3d start(n * std::cos(theta), n * std::sin(theta), 0.0);
            const Hit hit = cast(T_world_lidar * start, T_world_lidar.linear() * direction, time);
            if (hit.distance <= 0.0) continue;
            const double distance = hit.distance + options_.range_noise_m * normal_(random_);
            const auto range_mm = static_cast<std::uint32_t>(std::lround((distance + n) * 1000.0 / 8.0)) * 8U;
            if (range_mm == 0) continue;
            const int c = (m + sensor_.pixel_shift[row]) % w;
            moving_(r, c) = hit.moving ? 1 : 0;
            frame.raw.range_mm(r, c) = range_mm;
            const Eigen::Vector3d p_lidar = start + (range_mm * 1e-3 - n) * direction;
            const Eigen::Vector3f point = (sensor_.T_sensor_lidar * p_lidar).cast<float>();
            frame.cloud.x(r, c) = point.x();
            frame.cloud.y(r, c) = point.y();
            frame.cloud.z(r, c) = point.z();
            frame.cloud.range_m(r, c) = point.norm();
        }
    }
    frame.header.usable = frame.header.valid_columns * 10 >= w * 3;
    last_stamp_s_ = static_cast<double>(frame.header.stamp_ns - kEpoch_ns) * 1e-9;
    if (spoil_frame) spoil_frame(k, frame);
}

}  // namespace dlod::test
