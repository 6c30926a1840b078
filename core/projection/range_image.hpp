// Points and pixels of a range image (paper, Sec. "Range Image-based Segmentation", Eq. 1 to 3), for any cloud by
// angle, for structured clouds by index, and for this sensor's own image with its uneven beams.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "core/types/image.hpp"
#include "core/types/sensor_model.hpp"

namespace dlod {

struct Pixel {
    int row = 0;
    int column = 0;
    friend bool operator==(const Pixel&, const Pixel&) = default;
};

/// Eq. 2: what a range image stores, metres.
inline float range_of(const Eigen::Vector3f& point) {
    return point.norm();
}

/// Eq. 3: the pixel of point `index` of a structured, row-major cloud.
inline Pixel pixel_of(PixelIndex index, int width) {
    return {static_cast<int>(index) / width, static_cast<int>(index) % width};
}

/// Eq. 1: cylindrical projection of unstructured clouds by angle, beams evenly spread between two elevations.
class UniformProjection {
  public:
    /// @param up_rad upper edge of the image (f_up), @param down_rad lower edge
    UniformProjection(int height, int width, double up_rad, double down_rad);

    /// The pixel that the point falls into; nothing above or below the image, or at the origin.
    std::optional<Pixel> project(const Eigen::Vector3f& point) const;

    /// Range image of a cloud; where several points share a pixel the nearest counts, 0 where there is none.
    void render(std::span<const Eigen::Vector3f> cloud, Image<float>& range_m) const;

  private:
    int height_;
    int width_;
    double up_rad_;
    double rows_per_rad_;
    double columns_per_rad_;
};

/// Where an arbitrary point would appear in this sensor's destaggered image: the row by a table of the beams'
/// elevations, the column by azimuth with the row's azimuth offset, pixel shift and the beams' radial origin. Sensor
/// and point in one frame at one moment: motion during the sweep is the caller's.
class SensorProjection {
  public:
    explicit SensorProjection(const SensorModel& sensor);

    /// @param point sensor frame, metres. Nothing above or below the beams, by more than half their spacing.
    std::optional<Pixel> project(const Eigen::Vector3f& point) const;

    /// Projects n points p by T_sensor_points: `pixel` gets row * width + column, -1 outside the image; `range_m` the
    /// distance from the sensor's origin. Faster than project() and the same but for points within 1e-3 pixels of an
    /// edge.
    /// @param column_shift [1 + height] added to the column of each row, from the second entry on, or nullptr
    void project(const Eigen::Isometry3f& T_sensor_points, int n, const float* x, const float* y, const float* z,
                 const float* column_shift, std::int32_t* pixel, float* range_m) const;

    int height() const { return height_; }
    int width() const { return width_; }

  private:
    int height_;
    int width_;
    Eigen::Isometry3f T_lidar_sensor_;
    float beam_origin_m_;
    float tangent_low_ = 0.0F;  ///< of the elevation at the table's first entry
    float entries_per_tangent_ = 0.0F;
    AlignedVector<std::int32_t> row_of_tangent_;  ///< -1 outside the beams at both ends
    AlignedVector<float> column_zero_;            ///< [1 + H] column of a beam at azimuth 0; first a row outside
    AlignedVector<float> column_per_inverse_m_;   ///< [1 + H] correction for the beam's origin: divided by the distance
    AlignedVector<float> no_shift_;               ///< [1 + H] zeros
};

}  // namespace dlod
