// What the method must know of the lidar: plain numbers, whatever the maker and firmware.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace dlod {

/// Beam geometry of a spinning lidar whose images are destaggered (see Frame for the image layout).
struct SensorModel {
    int height = 0;               ///< rows (beams), row 0 the top one
    int width = 0;                ///< columns a turn
    int column_window_first = 0;  ///< measurement ids that the sensor sends, inclusive, may wrap
    int column_window_last = 0;
    double frame_period_s = 0.1;            ///< one turn
    std::vector<float> altitude_rad;        ///< [height] beam elevation in the lidar frame, up positive
    std::vector<float> azimuth_offset_rad;  ///< [height] beam azimuth offset, Ouster's sign
    std::vector<int> pixel_shift;           ///< [height] destagger shift: column = (measurement + shift) mod width
    float beam_origin_m = 0.0F;             ///< radial offset of the beam's origin from the lidar's axis
    float beam_origin_height_m = 0.0F;      ///< and above the lidar's origin; 0 but for domes
    Eigen::Isometry3d T_sensor_lidar = Eigen::Isometry3d::Identity();
    Eigen::Isometry3d T_sensor_imu = Eigen::Isometry3d::Identity();

    std::size_t pixels() const { return static_cast<std::size_t>(height) * static_cast<std::size_t>(width); }

    /// Angle between neighbouring columns, and on average between neighbouring rows.
    double column_rad() const { return 2.0 * std::numbers::pi / width; }
    double row_rad() const {
        return std::abs(static_cast<double>(altitude_rad.front() - altitude_rad.back())) / std::max(1, height - 1);
    }

    /// Measurement id (firing order within the turn) of the destaggered pixel (row, column).
    int measurement_of(int row, int column) const {
        const int m = (column - pixel_shift[static_cast<std::size_t>(row)]) % width;
        return m < 0 ? m + width : m;
    }
};

}  // namespace dlod
