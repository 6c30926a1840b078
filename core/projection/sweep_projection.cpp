#include "core/projection/sweep_projection.hpp"

namespace dlod {

SweepProjection::SweepProjection(const SensorModel& sensor) : sensor_(sensor), projection_(sensor) {
    T_block_stamp_.fill(Eigen::Isometry3f::Identity());
}

void SweepProjection::set(const OdometryResult& odometry) {
    T_sensor_world_ = odometry.T_world_sensor.inverse();
    for (int b = 0; b < kBlocks; ++b) {
        const auto middle = static_cast<std::size_t>((2 * b + 1) * sensor_.width / (2 * kBlocks));
        Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
        for (int i = 0; i < 12; ++i) T.matrix()(i / 4, i % 4) = odometry.deskew[i][middle];
        T_block_stamp_[static_cast<std::size_t>(b)] = T.inverse();
    }
}

std::optional<SweepProjection::Appearance> SweepProjection::project(const Eigen::Vector3d& world_m) const {
    const Eigen::Vector3f at_stamp = (T_sensor_world_ * world_m).cast<float>();
    // Any row gives the azimuth: points above and below the image at the stamp may be inside when fired at.
    std::optional<Pixel> pixel = projection_.project(Eigen::Vector3f(at_stamp.x(), at_stamp.y(), 0.0F));
    if (!pixel) pixel = projection_.project(at_stamp);
    if (!pixel) return std::nullopt;
    // The motion between the column's time and the stamp: what the column itself moves by it changes nothing more.
    const int block = sensor_.measurement_of(pixel->row, pixel->column) * kBlocks / sensor_.width;
    const Eigen::Vector3f p = T_block_stamp_[static_cast<std::size_t>(block)] * at_stamp;
    pixel = projection_.project(p);
    if (!pixel) return std::nullopt;
    return Appearance{*pixel, range_of(p)};
}

}  // namespace dlod
