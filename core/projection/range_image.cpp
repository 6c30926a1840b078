#include "core/projection/range_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr int kTableSize = 8192;  // 0.014 degrees an entry over 120 degrees: a tenth of the finest beam spacing or less

struct BatchParameters {
    float rotation[9];
    float translation[3];
    float origin[3];  // of the sensor frame, in the lidar frame
    float beam_origin;
    float tangent_low, entries_per_tangent;
    float columns_per_rad;
};

constexpr int kChunk = 256;  // points between the steps of a batch: small enough for the innermost cache

/// Step 1: range, table entry of the elevation, column of the azimuth and inverse distance. No look-ups, so that it
/// vectorises.
DLOD_MULTIVERSION_512 void locate(const BatchParameters& parameters, int n, const float* __restrict x,
                                  const float* __restrict y, const float* __restrict z, std::int32_t* __restrict entry,
                                  float* __restrict column, float* __restrict inverse_m, float* __restrict range) {
    const BatchParameters p = parameters;
    constexpr auto kLastEntry = static_cast<float>(kTableSize - 1);
    for (int i = 0; i < n; ++i) {
        const float lx = p.rotation[0] * x[i] + p.rotation[1] * y[i] + p.rotation[2] * z[i] + p.translation[0];
        const float ly = p.rotation[3] * x[i] + p.rotation[4] * y[i] + p.rotation[5] * z[i] + p.translation[1];
        const float lz = p.rotation[6] * x[i] + p.rotation[7] * y[i] + p.rotation[8] * z[i] + p.translation[2];
        const float squared = lx * lx + ly * ly;
        const float inverse = 1.0F / std::sqrt(squared > 1e-6F ? squared : 1e-6F);
        const float from_beam = squared * inverse - p.beam_origin;
        const float tangent = lz / (from_beam > 1e-3F ? from_beam : 1e-3F);
        float place = (tangent - p.tangent_low) * p.entries_per_tangent;
        place = place > 0.0F ? place : 0.0F;
        place = place < kLastEntry ? place : kLastEntry;
        entry[i] = static_cast<std::int32_t>(place);
        // Azimuth: a polynomial for the arc tangent of at most 1, then the octants; within 1e-5 rad.
        const float ax = std::abs(lx);
        const float ay = std::abs(ly);
        const float small = ax < ay ? ax : ay;
        const float large = ax < ay ? ay : ax;
        const float q = small / (large > 1e-6F ? large : 1e-6F);
        const float s = q * q;
        float angle =
            q * (0.99997726F +
                 s * (-0.33262347F + s * (0.19354346F + s * (-0.11643287F + s * (0.05265332F - s * 0.01172120F)))));
        angle = ax < ay ? 1.57079633F - angle : angle;
        angle = lx < 0.0F ? 3.14159265F - angle : angle;
        angle = ly < 0.0F ? -angle : angle;
        column[i] = 0.5F - p.columns_per_rad * angle;
        inverse_m[i] = inverse;
        const float sx = lx - p.origin[0];
        const float sy = ly - p.origin[1];
        const float sz = lz - p.origin[2];
        range[i] = std::sqrt(sx * sx + sy * sy + sz * sz);
    }
}

/// Step 2: rows from the table.
DLOD_MULTIVERSION_512 void look_up_rows(int n, const std::int32_t* __restrict entry,
                                        const std::int32_t* __restrict row_of_tangent, std::int32_t* __restrict row) {
    for (int i = 0; i < n; ++i) row[i] = row_of_tangent[entry[i]];
}

/// Step 3: the rows' own column offsets. The tables begin with an entry for row -1.
DLOD_MULTIVERSION_512 void finish_columns(int width, int n, const std::int32_t* __restrict row,
                                          const float* __restrict column, const float* __restrict inverse_m,
                                          const float* __restrict column_zero,
                                          const float* __restrict column_per_inverse_m,
                                          const float* __restrict column_shift, std::int32_t* __restrict pixel) {
    const auto turn = static_cast<float>(width);
    for (int i = 0; i < n; ++i) {
        float c = column[i] + column_zero[row[i] + 1] + column_shift[row[i] + 1] +
                  column_per_inverse_m[row[i] + 1] * inverse_m[i];
        c = c < 0.0F ? c + turn : c;
        c = c < 0.0F ? c + turn : c;
        c = c >= turn ? c - turn : c;
        c = c >= turn ? c - turn : c;
        std::int32_t whole = static_cast<std::int32_t>(c);
        whole = whole < width ? whole : 0;
        pixel[i] = row[i] >= 0 ? row[i] * width + whole : -1;
    }
}

}  // namespace

UniformProjection::UniformProjection(int height, int width, double up_rad, double down_rad)
    : height_(height),
      width_(width),
      up_rad_(up_rad),
      rows_per_rad_(height / (up_rad - down_rad)),
      columns_per_rad_(width / (2.0 * std::numbers::pi)) {}

std::optional<Pixel> UniformProjection::project(const Eigen::Vector3f& point) const {
    const Eigen::Vector3d p = point.cast<double>();
    if (p.squaredNorm() == 0.0) return std::nullopt;
    const double row = std::floor((up_rad_ - std::atan2(p.z(), std::hypot(p.x(), p.y()))) * rows_per_rad_);
    if (row < 0.0 || row >= height_) return std::nullopt;
    const int column = static_cast<int>(std::floor(std::atan2(p.x(), p.y()) * columns_per_rad_));
    return Pixel{static_cast<int>(row), ((column % width_) + width_) % width_};
}

void UniformProjection::render(std::span<const Eigen::Vector3f> cloud, Image<float>& range_m) const {
    range_m.resize(height_, width_, 0.0F);
    for (const Eigen::Vector3f& point : cloud) {
        const auto pixel = project(point);
        if (!pixel) continue;
        float& nearest = range_m(pixel->row, pixel->column);
        const float range = range_of(point);
        if (nearest == 0.0F || range < nearest) nearest = range;
    }
}

SensorProjection::SensorProjection(const SensorModel& sensor)
    : height_(sensor.height),
      width_(sensor.width),
      T_lidar_sensor_(sensor.T_sensor_lidar.inverse().cast<float>()),
      beam_origin_m_(sensor.beam_origin_m) {
    const double columns_per_rad = sensor.width / (2.0 * std::numbers::pi);
    const auto rows = static_cast<std::size_t>(sensor.height);
    column_zero_.push_back(0.0F);
    column_per_inverse_m_.push_back(0.0F);
    for (std::size_t r = 0; r < rows; ++r) {
        // Beam azimuth theta + a with theta = 2 pi (1 - m / W), a = -azimuth_offset: solved for m and destaggered.
        const double a = -static_cast<double>(sensor.azimuth_offset_rad[r]);
        column_zero_.push_back(static_cast<float>(sensor.pixel_shift[r] + a * columns_per_rad));
        column_per_inverse_m_.push_back(
            static_cast<float>(-columns_per_rad * static_cast<double>(sensor.beam_origin_m) * std::sin(a)));
    }
    no_shift_.assign(rows + 1, 0.0F);
    const auto [low, high] = std::minmax_element(sensor.altitude_rad.begin(), sensor.altitude_rad.end());
    const double margin = rows > 1 ? 0.5 * static_cast<double>(*high - *low) / static_cast<double>(rows - 1) : 0.01;
    const double lowest = static_cast<double>(*low) - margin;
    const double highest = static_cast<double>(*high) + margin;
    const double tangent_low = std::tan(lowest);
    const double step = (std::tan(highest) - tangent_low) / (kTableSize - 3);
    // The first and the last entry catch what lies outside.
    tangent_low_ = static_cast<float>(tangent_low - step);
    entries_per_tangent_ = static_cast<float>(1.0 / step);
    row_of_tangent_.assign(kTableSize, -1);
    for (int i = 1; i + 1 < kTableSize; ++i) {
        const double altitude = std::atan(tangent_low + (static_cast<double>(i) - 0.5) * step);
        if (altitude < lowest || altitude > highest) continue;
        double best = std::numeric_limits<double>::max();
        for (std::size_t r = 0; r < rows; ++r) {
            const double off = std::abs(static_cast<double>(sensor.altitude_rad[r]) - altitude);
            if (off < best) {
                best = off;
                row_of_tangent_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(r);
            }
        }
    }
}

std::optional<Pixel> SensorProjection::project(const Eigen::Vector3f& point) const {
    std::int32_t pixel = -1;
    float range = 0.0F;
    project(Eigen::Isometry3f::Identity(), 1, &point.x(), &point.y(), &point.z(), nullptr, &pixel, &range);
    if (pixel < 0) return std::nullopt;
    return pixel_of(static_cast<PixelIndex>(pixel), width_);
}

void SensorProjection::project(const Eigen::Isometry3f& T_sensor_points, int n, const float* x, const float* y,
                               const float* z, const float* column_shift, std::int32_t* pixel, float* range_m) const {
    const Eigen::Isometry3f T = T_lidar_sensor_ * T_sensor_points;
    BatchParameters parameters{};
    for (int i = 0; i < 9; ++i) parameters.rotation[i] = T.linear()(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) {
        parameters.translation[i] = T.translation()[i];
        parameters.origin[i] = T_lidar_sensor_.translation()[i];
    }
    parameters.beam_origin = beam_origin_m_;
    parameters.tangent_low = tangent_low_;
    parameters.entries_per_tangent = entries_per_tangent_;
    parameters.columns_per_rad = static_cast<float>(width_ / (2.0 * std::numbers::pi));
    const float* shift = column_shift != nullptr ? column_shift : no_shift_.data();
    std::int32_t entry[kChunk];
    std::int32_t row[kChunk];
    float column[kChunk];
    float inverse_m[kChunk];
    for (int begin = 0; begin < n; begin += kChunk) {
        const int count = std::min(kChunk, n - begin);
        locate(parameters, count, x + begin, y + begin, z + begin, entry, column, inverse_m, range_m + begin);
        look_up_rows(count, entry, row_of_tangent_.data(), row);
        finish_columns(width_, count, row, column, inverse_m, column_zero_.data(), column_per_inverse_m_.data(), shift,
                       pixel + begin);
    }
}

}  // namespace dlod
