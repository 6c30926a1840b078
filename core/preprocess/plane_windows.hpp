// Planes through small windows of the range image, by linear least squares in inverse range.
//
// On a plane the inverse range along a beam is linear in the beam's tangent-plane coordinates, and these are constants
// of the row: normal and smoothed range of a window are fixed linear combinations of its inverse ranges, no eigenvalues
// and no neighbour search. The noise of a lidar lies along the beam, so this is also the maximum-likelihood fit.
#pragma once

#include <vector>

#include "core/types/frame.hpp"

namespace dlod {

/// Half width and half height of a window [pixels].
inline constexpr int kWindowRadius = 2;
inline constexpr int kWindowSide = 2 * kWindowRadius + 1;
inline constexpr int kWindowPixels = kWindowSide * kWindowSide;

/// The planes around all pixels of one row. A window with a missing pixel, or with pixels a turn apart in time (the
/// seam), has inverse range 0.
struct PlaneRow {
    AlignedVector<float> inverse_range;  ///< [W] smoothed, 1/m, from the beam's origin
    AlignedVector<float> slope_azimuth;  ///< [W] derivative of the inverse range along the row, towards growing columns
    AlignedVector<float> slope_altitude;  ///< [W] the same upwards
    AlignedVector<float> deviation_m;     ///< [W] root mean square deviation of the ranges from the plane
};

/// A beam's direction and its two tangents, sensor frame.
struct BeamFrame {
    Eigen::Vector3f direction, along_row, up;
};

class PlaneWindows {
  public:
    explicit PlaneWindows(const SensorModel& sensor);

    /// Inverse ranges of the whole image, from the raw ranges; call it first for each frame.
    void load(const Frame& frame);
    /// Fits all windows whose centre lies in `row`.
    void fit_row(int row, PlaneRow& planes) const;
    /// Inverse range of one pixel from its beam's origin, 0 without return.
    float inverse_range(int row, int column) const { return inverse_.row(row)[column + kWindowRadius]; }
    BeamFrame beam(int row, int column) const;

  private:
    /// Weights of a window's pixels in inverse range and its two slopes, and the tangent-plane coordinates.
    struct RowModel {
        float weight[3][kWindowPixels];
        float scale[kWindowPixels];  ///< 1 / (u . d): inverse range to inverse depth along the centre beam
        float azimuth[kWindowPixels];
        float altitude[kWindowPixels];
        int first_row = 0;  ///< topmost row of the window; clamped at the image's edge
        float cos_altitude = 1.0F;
        float sin_altitude = 0.0F;
        float cos_offset = 1.0F;  ///< of the row's azimuth offset
        float sin_offset = 0.0F;
    };

    SensorModel sensor_;
    std::vector<RowModel> model_;                     ///< by row
    Image<float> inverse_;                            ///< padded by kWindowRadius columns on both sides, wrapped
    std::vector<std::vector<std::uint8_t>> usable_;   ///< by row: 1 where the window does not straddle the seam
    AlignedVector<float> cos_azimuth_, sin_azimuth_;  ///< by measurement: encoder angle
    Eigen::Matrix3f R_sensor_lidar_;
};

}  // namespace dlod
