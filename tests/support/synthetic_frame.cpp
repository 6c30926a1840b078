#include "tests/support/synthetic_frame.hpp"

#include <cmath>
#include <numbers>

namespace dlod::test {

SensorModel small_sensor() {
    SensorModel sensor;
    sensor.height = 32;
    sensor.width = 256;
    sensor.column_window_last = sensor.width - 1;
    for (int r = 0; r < sensor.height; ++r) {
        sensor.altitude_rad.push_back(static_cast<float>(0.7 - 1.4 * r / (sensor.height - 1)));
        sensor.azimuth_offset_rad.push_back(0.0F);
        sensor.pixel_shift.push_back(0);
    }
    return sensor;
}

void SyntheticFrame::next(double dt_s) {
    ++frame.header.sequence;
    frame.header.stamp_ns += static_cast<std::int64_t>(std::llround(1e9 * dt_s));
    for (auto& time : frame.columns.time_ns) time = frame.header.stamp_ns;
    frame.raw.range_mm.fill(0);
    for (auto* image : {&frame.odometry.x, &frame.odometry.y, &frame.odometry.z, &frame.cloud.range_m})
        image->fill(0.0F);
    frame.prepared.ground.fill(0);
    frame.detection.clear();
    next_pixel_ = 0;
}

std::vector<PixelIndex> SyntheticFrame::place(const Cylinder& cylinder) {
    const Eigen::Isometry3d T_sensor_world = frame.odometry.T_world_sensor.inverse();
    const Eigen::Vector3d to_sensor = frame.odometry.T_world_sensor.translation() - cylinder.foot_m;
    const double facing = std::atan2(to_sensor.y(), to_sensor.x());
    std::vector<PixelIndex> pixels;
    constexpr int kAcross = 12;
    for (int i = 0; i < cylinder.points; ++i) {
        const double angle = facing + std::numbers::pi * ((i % kAcross + 0.5) / kAcross - 0.5);
        const double height = cylinder.height_m * (static_cast<double>(i) / std::max(1, cylinder.points - 1));
        const Eigen::Vector3d world = cylinder.foot_m + Eigen::Vector3d(cylinder.radius_m * std::cos(angle),
                                                                        cylinder.radius_m * std::sin(angle), height);
        const Eigen::Vector3f p = (T_sensor_world * world).cast<float>();
        const PixelIndex pixel = next_pixel_++;
        frame.odometry.x[pixel] = p.x();
        frame.odometry.y[pixel] = p.y();
        frame.odometry.z[pixel] = p.z();
        frame.cloud.range_m[pixel] = p.norm();
        frame.raw.range_mm[pixel] = static_cast<std::uint32_t>(1000.0F * p.norm());
        pixels.push_back(pixel);
    }
    return pixels;
}

Detection& SyntheticFrame::detect(const std::vector<PixelIndex>& pixels, bool moving) {
    DetectionResult& result = frame.detection;
    Detection detection;
    detection.segment = static_cast<std::uint32_t>(result.detections.size());
    detection.first = static_cast<std::uint32_t>(result.pixels.size());
    detection.count = static_cast<std::uint32_t>(pixels.size());
    result.pixels.insert(result.pixels.end(), pixels.begin(), pixels.end());
    const int count = static_cast<int>(pixels.size());
    detection.free_points = moving ? count * 7 / 10 : 0;
    detection.occupied_points = count - detection.free_points;
    detection.average_residual_m = moving ? 0.8 : 0.02;
    detection.residual_points = count / 4;
    result.detections.push_back(detection);
    return result.detections.back();
}

}  // namespace dlod::test
