// Hand-made range images: every pixel of a sensor shot at simple shapes.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>

#include "core/types/frame.hpp"

namespace dlod::test {

/// A sensor of evenly spread beams, without offsets and with the lidar's axes turned as in Ouster's sensors.
inline SensorModel even_sensor(int height, int width, double top_rad, double bottom_rad) {
    SensorModel sensor;
    sensor.height = height;
    sensor.width = width;
    sensor.column_window_last = width - 1;
    for (int r = 0; r < height; ++r) {
        sensor.altitude_rad.push_back(static_cast<float>(top_rad + (bottom_rad - top_rad) * r / (height - 1)));
        sensor.azimuth_offset_rad.push_back(0.0F);
        sensor.pixel_shift.push_back(0);
    }
    sensor.T_sensor_lidar.linear() = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return sensor;
}

/// Unit direction of a pixel's beam in the sensor frame.
inline Eigen::Vector3d beam(const SensorModel& sensor, int row, int column) {
    const double theta =
        2.0 * std::numbers::pi * (1.0 - sensor.measurement_of(row, column) / static_cast<double>(sensor.width)) -
        static_cast<double>(sensor.azimuth_offset_rad[static_cast<std::size_t>(row)]);
    const double phi = static_cast<double>(sensor.altitude_rad[static_cast<std::size_t>(row)]);
    return sensor.T_sensor_lidar.linear() *
           Eigen::Vector3d(std::cos(theta) * std::cos(phi), std::sin(theta) * std::cos(phi), std::sin(phi));
}

/// Range of a ray from `origin` along the unit `direction`, or 0 or less where it meets nothing.
using Scene = std::function<double(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;

/// Fills the frame's cloud (beams from the sensor's origin), pose and deskewed cloud as seen from `pose` at rest.
inline void render(const SensorModel& sensor, const Scene& scene, const Eigen::Isometry3d& pose, Frame& frame) {
    for (int r = 0; r < sensor.height; ++r) {
        for (int c = 0; c < sensor.width; ++c) {
            const Eigen::Vector3d direction = beam(sensor, r, c);
            const double range = scene(pose.translation(), pose.linear() * direction);
            const bool hit = range > 0.0 && range < 200.0;
            const Eigen::Vector3f p = ((hit ? range : 0.0) * direction).cast<float>();
            frame.cloud.range_m(r, c) = hit ? static_cast<float>(range) : 0.0F;
            frame.raw.range_mm(r, c) = hit ? static_cast<std::uint32_t>(range * 1000.0) : 0U;
            frame.cloud.x(r, c) = frame.odometry.x(r, c) = p.x();
            frame.cloud.y(r, c) = frame.odometry.y(r, c) = p.y();
            frame.cloud.z(r, c) = frame.odometry.z(r, c) = p.z();
        }
    }
    for (int i = 0; i < 12; ++i)
        std::fill(frame.odometry.deskew[i].begin(), frame.odometry.deskew[i].end(), i % 5 == 0 ? 1.0F : 0.0F);
    frame.odometry.valid = true;
    frame.odometry.T_world_sensor = pose;
}

/// Range to the plane normal . p = offset; 0 where the ray does not meet its front.
inline double plane_range(const Eigen::Vector3d& normal, double offset, const Eigen::Vector3d& o,
                          const Eigen::Vector3d& d) {
    const double along = normal.dot(d);
    return std::abs(along) < 1e-9 ? 0.0 : (offset - normal.dot(o)) / along;
}

/// Range to an axis-aligned box, 0 where the ray misses it.
inline double box_range(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const Eigen::Vector3d& o,
                        const Eigen::Vector3d& d) {
    double enter = 0.0;
    double leave = 1e9;
    for (int i = 0; i < 3; ++i) {
        if (std::abs(d[i]) < 1e-12) {
            if (o[i] < low[i] || o[i] > high[i]) return 0.0;
            continue;
        }
        const double a = (low[i] - o[i]) / d[i];
        const double b = (high[i] - o[i]) / d[i];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave ? enter : 0.0;
}

/// The nearer of two ranges where 0 or less means none.
inline double nearest(double a, double b) {
    return a <= 0.0 ? b : b <= 0.0 ? a : std::min(a, b);
}

}  // namespace dlod::test
