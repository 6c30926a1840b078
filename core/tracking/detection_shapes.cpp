#include "core/tracking/detection_shapes.hpp"

#include <algorithm>

namespace dlod {

void DetectionShapes::compute(Frame& frame) {
    const OdometryResult& odometry = frame.odometry;
    gather_points(frame.detection.pixels, odometry.x, odometry.y, odometry.z, odometry.T_world_sensor, points_);
    shapes_.resize(frame.detection.detections.size());
    for (std::size_t i = 0; i < shapes_.size(); ++i) describe(frame, i);
}

void DetectionShapes::recompute(Frame& frame, std::size_t index) {
    if (index >= shapes_.size()) shapes_.resize(index + 1);
    describe(frame, index);
}

void DetectionShapes::describe(Frame& frame, std::size_t index) {
    Detection& detection = frame.detection.detections[index];
    DetectionShape& shape = shapes_[index];
    const PointSpan part = points(detection);
    shape.axis = principal_axis(part, origin());
    detection.box = box_at_yaw(part, origin(), shape.axis.yaw_rad);
    detection.centroid_m = shape.axis.centroid_m;
    detection.height_m = detection.box.size_m.z();

    // A few pixels give the mean time well enough: neighbours are fired together.
    const std::size_t stride = std::max<std::size_t>(1, detection.count / 16);
    std::int64_t sum_ns = 0;
    std::int64_t samples = 0;
    for (std::size_t i = 0; i < detection.count; i += stride) {
        const int pixel = static_cast<int>(frame.detection.pixels[detection.first + i]);
        const int measurement = sensor_.measurement_of(pixel / sensor_.width, pixel % sensor_.width);
        sum_ns += frame.header.stamp_ns - frame.columns.time_ns[static_cast<std::size_t>(measurement)];
        ++samples;
    }
    const double age_s = samples > 0 ? 1e-9 * static_cast<double>(sum_ns / samples) : 0.0;
    shape.age_s = std::clamp(age_s, 0.0, sensor_.frame_period_s);
}

}  // namespace dlod
