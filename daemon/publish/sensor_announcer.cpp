#include "daemon/publish/sensor_announcer.hpp"

namespace dlod::daemon {
namespace {

using RowMajor4d = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

sensor_t describe(const driver::SensorInfo& sensor, const Eigen::Isometry3d& T_base_sensor) {
    sensor_t message{};
    message.product_line = sensor.product_line;
    message.serial_number = sensor.serial_number;
    message.firmware = sensor.firmware;
    message.lidar_mode = sensor.lidar_mode;
    message.profile = sensor.profile_name;
    message.imu_profile = sensor.imu_profile_name;
    message.timestamp_mode = sensor.timestamp_mode;
    const SensorModel& model = sensor.model;
    message.rows = model.height;
    message.columns = model.width;
    message.first_measurement = model.column_window_first;
    message.last_measurement = model.column_window_last;
    message.frame_rate = 1.0 / model.frame_period_s;
    message.beam_altitude = model.altitude_rad;
    message.beam_azimuth = model.azimuth_offset_rad;
    message.pixel_shift.assign(model.pixel_shift.begin(), model.pixel_shift.end());
    message.beam_origin = static_cast<double>(model.beam_origin_m);
    message.beam_origin_height = static_cast<double>(model.beam_origin_height_m);
    RowMajor4d::Map(message.T_sensor_lidar) = model.T_sensor_lidar.matrix();
    RowMajor4d::Map(message.T_sensor_imu) = model.T_sensor_imu.matrix();
    RowMajor4d::Map(message.T_base_sensor) = T_base_sensor.matrix();
    return message;
}

}  // namespace

SensorAnnouncer::SensorAnnouncer(MessageBus& bus, const driver::SensorInfo& sensor,
                                 const Eigen::Isometry3d& T_base_sensor, const std::string& channel_prefix)
    : sender_(bus), channel_(channel_prefix + "SENSOR"), message_(describe(sensor, T_base_sensor)) {}

void SensorAnnouncer::announce_if_due(std::int64_t now_ns, std::int64_t utime) {
    if (sent_ns_ && now_ns - *sent_ns_ < kPeriod_ns) return;
    sent_ns_ = now_ns;
    message_.utime = utime;
    sender_.send(channel_, message_);
}

}  // namespace dlod::daemon
