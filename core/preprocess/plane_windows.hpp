// Planes through small windows of the range image, by linear least squares in inverse range.
//
// On a plane the inverse range along a beam is linear in the beam's tangent-plane coordinates, and these are constants
// of the row: normal and smoothed range of a window are fixed linear combinations of its inverse ranges, no eigenvalues
// and no neighbour search. The noise of a lidar lies along the beam, so this is also the maximum-likelihood fit.
//
// Where columns are missing, because their packets were lost, the same fit is done with the pixels that came, if these
// spread enough to tell the plane.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "core/types/frame.hpp"

namespace dlod {

/// Half width and, at most, half height of a window [pixels].
inline constexpr int kWindowRadius = 2;
inline constexpr int kWindowSide = 2 * kWindowRadius + 1;
/// Of a window as high as it is wide.
inline constexpr int kWindowPixels = kWindowSide * kWindowSide;

/// A beam's direction and its two tangents, sensor frame.
struct BeamFrame {
    Eigen::Vector3f direction, along_row, up;
};

/// When and from where the pixels of a window were fired, relative to the pixel in the centre: linear in the tangent
/// plane, fitted as the inverse range is. With beams of different azimuths a window's rows were fired up to some 50
/// columns apart, from origins up to a centimetre apart. What the fit sees is the surface as at that time, from there.
struct WindowFiring {
    struct Linear {
        float centre, along_row, up;
    };
    Linear time;       ///< columns
    Linear origin[3];  ///< metres; component of the beam's origin along BeamFrame's direction, along_row and up
};

/// The planes around every column_step-th pixel of one row. A window with a pixel without return, or with pixels a turn
/// apart in time (the seam), or of which too little came, has inverse range 0.
struct PlaneRow {
    AlignedVector<float> inverse_range;   ///< [W / column_step] smoothed, 1/m, from the beam's origin
    AlignedVector<float> slope_azimuth;   ///< derivative of the inverse range along the row, towards growing columns
    AlignedVector<float> slope_altitude;  ///< the same upwards
    AlignedVector<float> deviation_m;     ///< root mean square deviation of the ranges from the plane, of all pixels
    struct Partial {
        int window;
        WindowFiring firing;
    };
    std::vector<Partial> partial;  ///< windows with pixels of missing columns, ascending
};

class PlaneWindows {
  public:
    PlaneWindows(const SensorModel& sensor, int column_step);

    /// Inverse ranges of the whole image, from the raw ranges; call it first for each frame.
    void load(const Frame& frame);
    /// Fits all windows whose centre lies in `row`.
    void fit_row(int row, PlaneRow& planes) const;
    /// Number of windows in a row; the centre of window k is column k * column_step.
    int windows() const { return windows_; }
    /// Rows of a window: five, or three where the beams are so far apart that five would rarely meet one surface.
    int window_rows() const { return window_rows_; }
    /// Distance from the beam's origin, metres.
    float distance(std::uint32_t range_mm) const {
        return static_cast<float>(range_mm) * 1e-3F - sensor_.beam_origin_m;
    }
    /// @param measurement column in which the pixel was fired
    BeamFrame beam(int row, int measurement) const;
    /// A vector of (direction, along_row, up) of a BeamFrame, in the lidar's axes.
    std::array<float, 3> in_lidar_axes(int row, int measurement, const std::array<float, 3>& v) const {
        const RowModel& model = model_[static_cast<std::size_t>(row)];
        const auto [c, s] = azimuth_of(model, measurement);
        const float out = v[0] * model.cos_altitude - v[2] * model.sin_altitude;
        return {c * out + s * v[1], s * out - c * v[1], v[0] * model.sin_altitude + v[2] * model.cos_altitude};
    }
    /// Of all whole windows whose centre lies in `row`.
    const WindowFiring& firing(int row) const { return model_[static_cast<std::size_t>(row)].firing; }

  private:
    /// Weights of a window's pixels in inverse range and its two slopes, and the tangent-plane coordinates.
    struct RowModel {
        float weight[3][kWindowPixels];
        float scale[kWindowPixels];  ///< 1 / (u . d): inverse range to inverse depth along the centre beam
        float azimuth[kWindowPixels];
        float altitude[kWindowPixels];
        float fired[kWindowPixels][4];  ///< when [columns], and from where [m], as in WindowFiring
        double slope_variance[2];       ///< of a whole window, per variance of an inverse depth
        WindowFiring firing;
        int first_row = 0;  ///< topmost row of the window; clamped at the image's edge
        float cos_altitude = 1.0F;
        float sin_altitude = 0.0F;
        float cos_offset = 1.0F;  ///< of the row's azimuth offset
        float sin_offset = 0.0F;
    };

    /// Cosine and sine of a beam's azimuth.
    std::pair<float, float> azimuth_of(const RowModel& model, int measurement) const {
        const auto m = static_cast<std::size_t>(measurement);
        return {cos_azimuth_[m] * model.cos_offset - sin_azimuth_[m] * model.sin_offset,
                sin_azimuth_[m] * model.cos_offset + cos_azimuth_[m] * model.sin_offset};
    }
    /// Place of the centre among a window's pixels.
    int centre_of(int row) const {
        return (row - model_[static_cast<std::size_t>(row)].first_row) * kWindowSide + kWindowRadius;
    }
    /// First value of each pixel of a row's windows.
    void find_pixels(int row, const float* (&pixels)[kWindowPixels]) const;
    void fit_partial(int row, int window, const float* const* pixels, PlaneRow& planes) const;

    float* part_of(int row, int part) {
        return inverse_.data() + (static_cast<std::size_t>(row) * static_cast<std::size_t>(column_step_) +
                                  static_cast<std::size_t>(part)) *
                                     stride_;
    }
    const float* part_of(int row, int part) const { return const_cast<PlaneWindows*>(this)->part_of(row, part); }

    SensorModel sensor_;
    std::vector<RowModel> model_;  ///< by row
    int column_step_;
    int windows_;
    int window_rows_;
    int window_pixels_;
    /// Inverse ranges, wrapped around the image's edge; 0 without return, kMissing of a missing column. A row holds
    /// column_step parts of stride_ values: part p is columns p, p + column_step, ..., after one that lies before the
    /// image, so that windows of a row are read without gaps.
    AlignedVector<float> inverse_;
    std::size_t stride_;
    std::vector<int> missing_;                        ///< measurement ids of the frame's missing columns
    std::vector<float> row_;                          ///< scratch: inverse ranges of a row in their order
    std::vector<std::vector<std::uint8_t>> usable_;   ///< by row and window: 1 where it does not straddle the seam
    AlignedVector<float> cos_azimuth_, sin_azimuth_;  ///< by measurement: encoder angle
    Eigen::Matrix3f R_sensor_lidar_;
};

}  // namespace dlod
