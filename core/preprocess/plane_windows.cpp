#include "core/preprocess/plane_windows.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

DLOD_MULTIVERSION
void invert_ranges(const std::uint32_t* __restrict range_mm, float* __restrict inverse, int count, float offset_m) {
    for (int c = 0; c < count; ++c) {
        const float distance = static_cast<float>(static_cast<std::int32_t>(range_mm[c])) * 1e-3F - offset_m;
        inverse[c] = distance > 1e-2F ? 1.0F / distance : 0.0F;
    }
}

constexpr float kLeastInverse = 1e-4F;  // of a plane, 1/m
/// Inverse range of a pixel whose column is missing.
constexpr float kMissing = -1.0F;
// A window of which a part is missing has to have pixels in so many rows and columns, or the plane could not fail to
// fit, and the slopes may be so many times less certain than those of a whole one, as variances.
constexpr int kLeastLines = 3;
constexpr double kMostVariance = 9.0;
// Windows of five rows are no higher than this, a little more than those of an OS0 with 64 rows. With 32 rows, three
// degrees apart, five would have to lie on 2 m of one wall at 10 m: little but the ground was flat, and poses were
// lost.
constexpr double kHighestWindow_rad = 0.12;

/// Eight windows side by side, in registers.
constexpr int kLanes = 8;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float)), aligned(alignof(float)), may_alias));

/// None of so many pixels has a return.
inline bool is_empty(const float* pixels) {
    std::uint64_t bits[kLanes * sizeof(float) / sizeof(std::uint64_t)];
    std::memcpy(bits, pixels, sizeof(bits));
    std::uint64_t any = 0;
    for (const std::uint64_t pair : bits) any |= pair;
    return any == 0;
}

/// Fits the windows of a row, `count` rounded up to whole lanes; pixels[k][i] is pixel k of window i, centre[i] the one
/// in its centre.
DLOD_MULTIVERSION
void fit_windows(const float* const* __restrict pixels, const float (*__restrict weight)[kWindowPixels],
                 const float* __restrict scale, const float* __restrict azimuth, const float* __restrict altitude,
                 const float* __restrict centre, int window_pixels, int count, float* __restrict inverse,
                 float* __restrict slope_azimuth, float* __restrict slope_altitude, float* __restrict deviation) {
    for (int start = 0; start < count; start += kLanes) {
        if (is_empty(centre + start)) {
            for (float* values : {inverse, slope_azimuth, slope_altitude, deviation}) {
                *reinterpret_cast<Lanes*>(values + start) = Lanes{};
            }
            continue;
        }
        Lanes a{}, b{}, g{}, squares{};
        Lanes low = *reinterpret_cast<const Lanes*>(pixels[0] + start);
#pragma GCC unroll 5
        for (int k = 0; k < window_pixels; ++k) {
            const Lanes f = *reinterpret_cast<const Lanes*>(pixels[k] + start);
            a += weight[0][k] * f;
            b += weight[1][k] * f;
            g += weight[2][k] * f;
            low = low < f ? low : f;
        }
#pragma GCC unroll 5
        for (int k = 0; k < window_pixels; ++k) {
            const Lanes f = *reinterpret_cast<const Lanes*>(pixels[k] + start);
            const Lanes e = f * scale[k] - (a + azimuth[k] * b + altitude[k] * g);
            squares += e * e;
        }
        *reinterpret_cast<Lanes*>(inverse + start) = low > 0.0F ? a : Lanes{};
        *reinterpret_cast<Lanes*>(slope_azimuth + start) = low > 0.0F ? b : Lanes{};
        *reinterpret_cast<Lanes*>(slope_altitude + start) = low > 0.0F ? g : Lanes{};
        *reinterpret_cast<Lanes*>(deviation + start) = squares;
    }
    const float share = 1.0F / static_cast<float>(window_pixels);
    for (int i = 0; i < count; ++i) {
        const float a = inverse[i];
        const bool whole = a > kLeastInverse;
        // d(range) = d(inverse) / inverse^2
        const float of_plane = std::sqrt(deviation[i] * share) / (a * a);
        inverse[i] = whole ? a : 0.0F;
        deviation[i] = whole ? of_plane : 0.0F;
    }
}

/// @param fit offset and two slopes of the firing time and of the three components of the origin
WindowFiring firing_of(const Eigen::Matrix<double, 3, 4>& fit) {
    const Eigen::Matrix<float, 3, 4> f = fit.cast<float>();
    WindowFiring firing;
    firing.time = {f(0, 0), f(1, 0), f(2, 0)};
    for (int i = 0; i < 3; ++i) firing.origin[i] = {f(0, i + 1), f(1, i + 1), f(2, i + 1)};
    return firing;
}

int rows_of_window(const SensorModel& sensor) {
    return (kWindowSide - 1) * sensor.row_rad() > kHighestWindow_rad ? kLeastLines : kWindowSide;
}

}  // namespace

PlaneWindows::PlaneWindows(const SensorModel& sensor, int column_step)
    : sensor_(sensor),
      column_step_(column_step),
      windows_(sensor.width / column_step),
      window_rows_(rows_of_window(sensor)),
      window_pixels_(window_rows_ * kWindowSide),
      R_sensor_lidar_(sensor.T_sensor_lidar.rotation().cast<float>()) {
    const int h = sensor.height;
    const int w = sensor.width;
    const double per_column = 2.0 * std::numbers::pi / w;
    // One value before the image and two after it at most: a window reaches kWindowRadius columns to either side.
    // Windows are read by whole lanes.
    stride_ = static_cast<std::size_t>(windows_ + 2 * kWindowRadius + kLanes);
    inverse_.assign(static_cast<std::size_t>(h) * static_cast<std::size_t>(column_step) * stride_, 0.0F);
    row_.resize(static_cast<std::size_t>(w));
    for (int m = 0; m < w; ++m) {
        const double theta = 2.0 * std::numbers::pi - per_column * m;
        cos_azimuth_.push_back(static_cast<float>(std::cos(theta)));
        sin_azimuth_.push_back(static_cast<float>(std::sin(theta)));
    }
    // Position of a row's beams relative to the image's columns, in columns.
    const auto offset_of = [&](int row) {
        const auto r = static_cast<std::size_t>(row);
        return static_cast<double>(sensor.azimuth_offset_rad[r]) / per_column - sensor.pixel_shift[r];
    };
    model_.resize(static_cast<std::size_t>(h));
    usable_.resize(static_cast<std::size_t>(h));
    for (int row = 0; row < h; ++row) {
        RowModel& model = model_[static_cast<std::size_t>(row)];
        model.first_row = std::clamp(row - window_rows_ / 2, 0, std::max(0, h - window_rows_));
        const double alt0 = sensor.altitude_rad[static_cast<std::size_t>(row)];
        model.cos_altitude = static_cast<float>(std::cos(alt0));
        model.sin_altitude = static_cast<float>(std::sin(alt0));
        model.cos_offset = std::cos(sensor.azimuth_offset_rad[static_cast<std::size_t>(row)]);
        model.sin_offset = -std::sin(sensor.azimuth_offset_rad[static_cast<std::size_t>(row)]);
        Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kWindowPixels, 3> X(window_pixels_, 3);
        Eigen::Matrix<double, Eigen::Dynamic, 4, 0, kWindowPixels, 4> fired(window_pixels_, 4);  // when, and from where
        for (int k = 0; k < window_pixels_; ++k) {
            const int other = std::min(model.first_row + k / kWindowSide, h - 1);
            const double alt = sensor.altitude_rad[static_cast<std::size_t>(other)];
            const double azimuth = (k % kWindowSide - kWindowRadius + offset_of(other) - offset_of(row)) * per_column;
            const double depth = std::sin(alt0) * std::sin(alt) + std::cos(alt0) * std::cos(alt) * std::cos(azimuth);
            X(k, 0) = 1.0;
            X(k, 1) = std::cos(alt) * std::sin(azimuth) / depth;
            X(k, 2) = (std::sin(alt) * std::cos(alt0) - std::cos(alt) * std::sin(alt0) * std::cos(azimuth)) / depth;
            const int behind =
                sensor.pixel_shift[static_cast<std::size_t>(row)] - sensor.pixel_shift[static_cast<std::size_t>(other)];
            fired(k, 0) = k % kWindowSide - kWindowRadius + std::remainder(behind, w);
            // The beam's origin lies in the direction of the encoder, clockwise of the beam by minus its offset.
            const double encoder0 = -static_cast<double>(sensor.azimuth_offset_rad[static_cast<std::size_t>(row)]);
            const double encoder = encoder0 + fired(k, 0) * per_column;
            const double radial = static_cast<double>(sensor.beam_origin_m) * (std::cos(encoder) - std::cos(encoder0));
            fired(k, 1) = radial * std::cos(alt0);
            fired(k, 2) = static_cast<double>(sensor.beam_origin_m) * (std::sin(encoder) - std::sin(encoder0));
            fired(k, 3) = -radial * std::sin(alt0);
            for (int i = 0; i < 4; ++i) model.fired[k][i] = static_cast<float>(fired(k, i));
            model.scale[k] = static_cast<float>(1.0 / depth);
            model.azimuth[k] = static_cast<float>(X(k, 1));
            model.altitude[k] = static_cast<float>(X(k, 2));
        }
        const Eigen::Matrix3d covariance = (X.transpose() * X + 1e-12 * Eigen::Matrix3d::Identity()).inverse();
        const Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kWindowPixels> solver = covariance * X.transpose();
        model.firing = firing_of(solver * fired);
        for (int i = 0; i < 2; ++i) model.slope_variance[i] = covariance(i + 1, i + 1);
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < window_pixels_; ++k) {
                model.weight[i][k] = static_cast<float>(solver(i, k)) * model.scale[k];
            }
        }
        auto& usable = usable_[static_cast<std::size_t>(row)];
        usable.assign(static_cast<std::size_t>(windows_), h >= window_rows_ ? 1 : 0);
        for (int i = 0; i < windows_; ++i) {
            int low = w;
            int high = -1;
            for (int k = 0; k < window_pixels_; ++k) {
                const int column = (i * column_step + k % kWindowSide - kWindowRadius + w) % w;
                const int m = sensor.measurement_of(std::min(model.first_row + k / kWindowSide, h - 1), column);
                low = std::min(low, m);
                high = std::max(high, m);
            }
            if (high - low > w / 2) usable[static_cast<std::size_t>(i)] = 0;
        }
    }
}

void PlaneWindows::load(const Frame& frame) {
    const int w = sensor_.width;
    missing_.clear();
    for (int m = 0; frame.header.valid_columns < w && m < w; ++m) {
        if (!frame.columns.valid[static_cast<std::size_t>(m)]) missing_.push_back(m);
    }
    for (int r = 0; r < sensor_.height; ++r) {
        invert_ranges(frame.raw.range_mm.row(r), row_.data(), w, sensor_.beam_origin_m);
        for (const int m : missing_) {
            const int shifted = m + sensor_.pixel_shift[static_cast<std::size_t>(r)];
            row_[static_cast<std::size_t>((shifted % w + w) % w)] = kMissing;
        }
        for (int p = 0; p < column_step_; ++p) {
            float* part = part_of(r, p);
            for (int i = 0; i < windows_; ++i)
                part[kWindowRadius + i] = row_[static_cast<std::size_t>(i * column_step_ + p)];
            for (int i = 1; i <= kWindowRadius; ++i) {
                const int before = ((p - i * column_step_) % w + w) % w;
                const int after = (p + (windows_ - 1 + i) * column_step_) % w;
                part[kWindowRadius - i] = row_[static_cast<std::size_t>(before)];
                part[kWindowRadius + windows_ - 1 + i] = row_[static_cast<std::size_t>(after)];
            }
        }
    }
}

void PlaneWindows::find_pixels(int row, const float* (&pixels)[kWindowPixels]) const {
    const int first_row = model_[static_cast<std::size_t>(row)].first_row;
    for (int k = 0; k < window_pixels_; ++k) {
        const int offset = k % kWindowSide - kWindowRadius;
        const int turns = offset >= 0 ? offset / column_step_ : -((column_step_ - 1 - offset) / column_step_);
        const int part = offset - turns * column_step_;
        pixels[k] = part_of(std::min(first_row + k / kWindowSide, sensor_.height - 1), part) + kWindowRadius + turns;
    }
}

void PlaneWindows::fit_row(int row, PlaneRow& planes) const {
    const auto count = static_cast<std::size_t>(windows_);
    for (auto* values : {&planes.inverse_range, &planes.slope_azimuth, &planes.slope_altitude, &planes.deviation_m}) {
        values->resize(count + kLanes);
    }
    planes.partial.clear();
    planes.partial.reserve(count);
    const RowModel& model = model_[static_cast<std::size_t>(row)];
    const float* pixels[kWindowPixels];
    find_pixels(row, pixels);
    fit_windows(pixels, model.weight, model.scale, model.azimuth, model.altitude, pixels[centre_of(row)],
                window_pixels_, windows_, planes.inverse_range.data(), planes.slope_azimuth.data(),
                planes.slope_altitude.data(), planes.deviation_m.data());
    const auto& usable = usable_[static_cast<std::size_t>(row)];
    for (std::size_t i = 0; i < count; ++i) {
        if (!usable[i]) planes.inverse_range[i] = 0.0F;
    }
    if (missing_.empty()) return;
    for (std::size_t i = 0; i < count; ++i) {
        if (usable[i] && planes.inverse_range[i] <= 0.0F) fit_partial(row, static_cast<int>(i), pixels, planes);
    }
}

/// Fits a window of which columns are missing to the pixels that came, if these suffice.
void PlaneWindows::fit_partial(int row, int window, const float* const* pixels, PlaneRow& planes) const {
    const RowModel& model = model_[static_cast<std::size_t>(row)];
    const auto at = static_cast<std::size_t>(window);
    if (pixels[centre_of(row)][at] <= 0.0F) return;
    float inverse_depth[kWindowPixels];
    float weight[kWindowPixels];  // 1 of what came, else 0
    unsigned came = 0;            // bit by pixel
    bool returned = true;
    for (int k = 0; k < window_pixels_; ++k) {
        const float value = pixels[k][at];
        returned &= value != 0.0F;
        weight[k] = value > 0.0F ? 1.0F : 0.0F;
        came |= static_cast<unsigned>(value > 0.0F) << k;
        inverse_depth[k] = value * model.scale[k];
    }
    constexpr unsigned kLine = (1U << kWindowSide) - 1;
    int rows = 0;
    unsigned columns = 0;
    for (int r = 0; r < window_rows_; ++r) {
        const unsigned line = (came >> (r * kWindowSide)) & kLine;
        rows += line != 0 ? 1 : 0;
        columns |= line;
    }
    const int count = std::popcount(came);
    if (!returned || count == window_pixels_ || rows < kLeastLines || std::popcount(columns) < kLeastLines) return;
    // Sums over the pixels of x (x, inverse depth) and of x (when, from where), with x = (1, along row, up).
    Eigen::Matrix<float, 4, 3> sums = Eigen::Matrix<float, 4, 3>::Zero();
    Eigen::Matrix<float, 4, 3> fired = Eigen::Matrix<float, 4, 3>::Zero();
    for (int k = 0; k < window_pixels_; ++k) {
        const float u = model.azimuth[k];
        const float v = model.altitude[k];
        const Eigen::RowVector3f x(weight[k], weight[k] * u, weight[k] * v);
        sums += Eigen::Vector4f(1.0F, u, v, inverse_depth[k]) * x;
        fired += Eigen::Map<const Eigen::Vector4f>(model.fired[k]) * x;
    }
    const Eigen::Matrix3d covariance = sums.topRows<3>().cast<double>().inverse();
    for (int i = 0; i < 2; ++i) {
        if (!(covariance(i + 1, i + 1) < kMostVariance * model.slope_variance[i])) return;
    }
    const Eigen::Vector3f plane = (covariance * sums.row(3).transpose().cast<double>()).cast<float>();
    if (plane[0] <= kLeastInverse) return;
    float squares = 0.0F;
    for (int k = 0; k < window_pixels_; ++k) {
        const float e = inverse_depth[k] - (plane[0] + model.azimuth[k] * plane[1] + model.altitude[k] * plane[2]);
        squares += weight[k] * e * e;
    }
    planes.inverse_range[at] = plane[0];
    planes.slope_azimuth[at] = plane[1];
    planes.slope_altitude[at] = plane[2];
    // As large as that of all pixels would be: three parameters have been fitted to fewer.
    const float share = static_cast<float>(window_pixels_ - 3) / static_cast<float>(window_pixels_ * (count - 3));
    planes.deviation_m[at] = std::sqrt(squares * share) / (plane[0] * plane[0]);
    planes.partial.push_back({window, firing_of(covariance * fired.transpose().cast<double>())});
}

BeamFrame PlaneWindows::beam(int row, int measurement) const {
    const RowModel& model = model_[static_cast<std::size_t>(row)];
    const auto [c, s] = azimuth_of(model, measurement);
    BeamFrame frame;
    frame.direction =
        R_sensor_lidar_ * Eigen::Vector3f(c * model.cos_altitude, s * model.cos_altitude, model.sin_altitude);
    // Columns grow clockwise: the azimuth falls.
    frame.along_row = R_sensor_lidar_ * Eigen::Vector3f(s, -c, 0.0F);
    frame.up = R_sensor_lidar_ * Eigen::Vector3f(-c * model.sin_altitude, -s * model.sin_altitude, model.cos_altitude);
    return frame;
}

}  // namespace dlod
