#include "driver/geometry.hpp"

#include <cmath>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod::driver {
namespace {

/// A run of pixels of one row whose measurements follow each other.
struct Beam {
    float forward, left, up;
    float beam_origin_m, beam_origin_height_m, beam_origin_distance_m;
};

DLOD_MULTIVERSION_512
void place_points(std::size_t count, const std::uint32_t* __restrict range_mm, const float* __restrict cos_theta,
                  const float* __restrict sin_theta, const Beam& beam, const float* __restrict T_sensor_lidar,
                  float* __restrict x, float* __restrict y, float* __restrict z, float* __restrict range_m) {
    const float forward = beam.forward;
    const float left = beam.left;
    const float up = beam.up;
    const float n = beam.beam_origin_m;
    const float h = beam.beam_origin_height_m;
    const float d = beam.beam_origin_distance_m;
    const float r00 = T_sensor_lidar[0], r01 = T_sensor_lidar[1], r02 = T_sensor_lidar[2], tx = T_sensor_lidar[3];
    const float r10 = T_sensor_lidar[4], r11 = T_sensor_lidar[5], r12 = T_sensor_lidar[6], ty = T_sensor_lidar[7];
    const float r20 = T_sensor_lidar[8], r21 = T_sensor_lidar[9], r22 = T_sensor_lidar[10], tz = T_sensor_lidar[11];
    for (std::size_t i = 0; i < count; ++i) {
        // Ranges have at most 20 bits: the signed conversion is exact, and the only one that AVX2 has.
        const float r = static_cast<float>(static_cast<std::int32_t>(range_mm[i])) * 1e-3F;
        const float rho = r - d;
        const float u = rho * forward + n;
        const float v = rho * left;
        const float w = rho * up + h;
        const float lx = u * cos_theta[i] - v * sin_theta[i];
        const float ly = u * sin_theta[i] + v * cos_theta[i];
        const float px = r00 * lx + r01 * ly + (r02 * w + tx);
        const float py = r10 * lx + r11 * ly + (r12 * w + ty);
        const float pz = r20 * lx + r21 * ly + (r22 * w + tz);
        const float distance = std::sqrt(px * px + py * py + pz * pz);
        const bool returned = range_mm[i] != 0;
        x[i] = returned ? px : 0.0F;
        y[i] = returned ? py : 0.0F;
        z[i] = returned ? pz : 0.0F;
        range_m[i] = returned ? distance : 0.0F;
    }
}

}  // namespace

Geometry::Geometry(const SensorModel& sensor)
    : width_(sensor.width), beam_origin_m_(sensor.beam_origin_m), beam_origin_height_m_(sensor.beam_origin_height_m) {
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 4; ++j)
            T_sensor_lidar_[4 * i + j] = static_cast<float>(sensor.T_sensor_lidar.matrix()(i, j));
    }
    for (std::size_t row = 0; row < static_cast<std::size_t>(sensor.height); ++row) {
        const double a = -static_cast<double>(sensor.azimuth_offset_rad[row]);
        const double p = sensor.altitude_rad[row];
        rows_.push_back({.forward = static_cast<float>(std::cos(a) * std::cos(p)),
                         .left = static_cast<float>(std::sin(a) * std::cos(p)),
                         .up = static_cast<float>(std::sin(p)),
                         .shift = ((sensor.pixel_shift[row] % width_) + width_) % width_});
    }
    for (int m = 0; m < width_; ++m) {
        const double theta = 2.0 * std::numbers::pi * (1.0 - static_cast<double>(m) / width_);
        cos_theta_.push_back(static_cast<float>(std::cos(theta)));
        sin_theta_.push_back(static_cast<float>(std::sin(theta)));
    }
}

void Geometry::process(Frame& frame) const {
    const float distance = std::hypot(beam_origin_m_, beam_origin_height_m_);
    for (std::size_t row = 0; row < rows_.size(); ++row) {
        const Row& constants = rows_[row];
        const Beam beam{constants.forward, constants.left,        constants.up,
                        beam_origin_m_,    beam_origin_height_m_, distance};
        const auto shift = static_cast<std::size_t>(constants.shift);
        const auto width = static_cast<std::size_t>(width_);
        const std::size_t first = row * width;
        const auto place = [&](std::size_t column, std::size_t measurement, std::size_t count) {
            const std::size_t pixel = first + column;
            place_points(count, frame.raw.range_mm.data() + pixel, cos_theta_.data() + measurement,
                         sin_theta_.data() + measurement, beam, T_sensor_lidar_, frame.cloud.x.data() + pixel,
                         frame.cloud.y.data() + pixel, frame.cloud.z.data() + pixel,
                         frame.cloud.range_m.data() + pixel);
        };
        // The shift cuts the row in two: columns from `shift` on hold measurements 0 .., those before it the last ones.
        place(shift, 0, width - shift);
        place(0, width - shift, shift);
    }
}

}  // namespace dlod::driver
