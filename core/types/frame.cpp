#include "core/types/frame.hpp"

namespace dlod {

Frame::Frame(const SensorModel& sensor) {
    const int h = sensor.height;
    const int w = sensor.width;
    raw.range_mm.resize(h, w);
    raw.reflectivity.resize(h, w);
    raw.signal.resize(h, w);
    raw.near_ir.resize(h, w);
    const auto columns_count = static_cast<std::size_t>(w);
    columns.time_ns.assign(columns_count, 0);
    columns.status.assign(columns_count, 0);
    columns.valid.assign(columns_count, 0);
    imu.reserve(256);
    for (auto* image : {&cloud.range_m, &cloud.x, &cloud.y, &cloud.z, &odometry.x, &odometry.y, &odometry.z}) image->resize(h, w);
    prepared.ground.resize(h, w);
    prepared.segment.resize(h, w);
    prepared.segments.reserve(4096);
    prepared.pixels.reserve(sensor.pixels());
    for (auto& row : odometry.deskew) row.assign(columns_count, 0.0F);
    detection.label.resize(h, w);
    detection.instance.resize(h, w);
    detection.pixels.reserve(sensor.pixels());
    detection.motion.reserve(sensor.pixels());
    detection.detections.reserve(1024);
    detection.tracks.reserve(512);
}

}  // namespace dlod
