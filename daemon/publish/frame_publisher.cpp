#include "daemon/publish/frame_publisher.hpp"

#include <algorithm>

#include "daemon/publish/bit_plane.hpp"

namespace dlod::daemon {
namespace {

/// LCM counts the channel's name and its end against the datagram.
std::size_t room_for(const std::string& channel) {
    return kLargestDatagram - channel.size() - 1;
}

template <class Message>
std::size_t encoded_size(const Message& message) {
    return static_cast<std::size_t>(message.getEncodedSize());
}

int rows_that_fit(const SensorModel& sensor, std::size_t room) {
    const std::size_t plane_bytes = (room - encoded_size(dynamic_mask_t{})) / 2;
    const auto rows = static_cast<int>(8 * plane_bytes / static_cast<std::size_t>(sensor.width));
    return std::min(rows, sensor.height);
}

std::size_t tracks_that_fit(std::size_t room) {
    const tracks_t none{};
    tracks_t one{};
    one.count = 1;
    one.tracks.resize(1);
    return (room - encoded_size(none)) / (encoded_size(one) - encoded_size(none));
}

std::size_t obstacles_that_fit(std::size_t room) {
    const obstacles_t none{};
    obstacles_t one{};
    one.count = 1;
    one.x = one.y = one.z = {0};
    one.track = {0};
    one.flags = {0};
    return (room - encoded_size(none)) / (encoded_size(one) - encoded_size(none));
}

void fill(const Track& track, track_t& message) {
    message.id = track.id;
    message.state = static_cast<std::int8_t>(track.state);
    message.yaw = track.box.yaw_rad;
    Eigen::Vector3d::Map(message.position) = track.box.center_m;
    Eigen::Vector3d::Map(message.size) = track.box.size_m;
    Eigen::Vector3d::Map(message.velocity) = track.velocity_mps;
    // Symmetric: row-major and column-major are the same.
    Eigen::Matrix<float, 6, 6>::Map(message.covariance) = track.covariance.cast<float>();
    message.points = track.points;
    message.hits = track.hits;
    message.misses = track.misses;
    message.age = track.age;
    message.residual = static_cast<float>(track.residual_m);
}

}  // namespace

FramePublisher::FramePublisher(MessageBus& bus, const SensorModel& sensor, const Eigen::Isometry3d& T_base_sensor,
                               const LcmConfig& config)
    : sender_(bus),
      T_sensor_base_(T_base_sensor.inverse()),
      mask_channel_(config.channel_prefix + "MASK"),
      tracks_channel_(config.channel_prefix + "TRACKS"),
      obstacles_channel_(config.channel_prefix + "OBSTACLES"),
      rows_per_part_(rows_that_fit(sensor, room_for(mask_channel_))),
      max_tracks_(tracks_that_fit(room_for(tracks_channel_))),
      obstacles_every_(static_cast<std::uint64_t>(config.obstacles.every_frames)) {
    if (obstacles_every_ > 0)
        obstacles_.emplace(sensor, config.obstacles, obstacles_that_fit(room_for(obstacles_channel_)));
    const auto plane_bytes = (static_cast<std::size_t>(rows_per_part_ * sensor.width) + 7) / 8;
    mask_.dynamic.reserve(plane_bytes);
    mask_.undecided.reserve(plane_bytes);
    tracks_.tracks.reserve(max_tracks_);
}

void FramePublisher::publish(const Frame& frame, std::int64_t utime) {
    publish_mask(frame, utime);
    publish_tracks(frame, utime);
    if (frame.odometry.valid && obstacles_) publish_obstacles(frame, utime);
}

void FramePublisher::publish_mask(const Frame& frame, std::int64_t utime) {
    const auto& label = frame.detection.label;
    mask_.utime = utime;
    mask_.sequence = static_cast<std::int64_t>(frame.header.sequence);
    mask_.height = label.height();
    mask_.width = label.width();
    mask_.parts = static_cast<std::int16_t>((label.height() + rows_per_part_ - 1) / rows_per_part_);
    for (std::int16_t part = 0; part < mask_.parts; ++part) {
        mask_.part = part;
        mask_.first_row = part * rows_per_part_;
        mask_.rows = std::min(rows_per_part_, label.height() - mask_.first_row);
        const std::span labels(label.row(mask_.first_row), static_cast<std::size_t>(mask_.rows * label.width()));
        const std::size_t bytes = (labels.size() + 7) / 8;
        mask_.bytes = static_cast<std::int32_t>(bytes);
        mask_.dynamic.resize(bytes);
        mask_.undecided.resize(bytes);
        pack_bit_plane(labels, static_cast<std::uint8_t>(PixelLabel::kDynamic), mask_.dynamic);
        pack_bit_plane(labels, static_cast<std::uint8_t>(PixelLabel::kUndecided), mask_.undecided);
        sender_.send(mask_channel_, mask_);
    }
}

void FramePublisher::publish_tracks(const Frame& frame, std::int64_t utime) {
    const Eigen::Vector3d robot = frame.odometry.T_world_sensor.translation();
    by_distance_.clear();
    for (const Track& track : frame.detection.tracks) {
        by_distance_.emplace_back((track.box.center_m - robot).squaredNorm(), &track);
    }
    std::sort(by_distance_.begin(), by_distance_.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first < b.first : a.second->id < b.second->id;
    });
    const std::size_t count = std::min(by_distance_.size(), max_tracks_);
    tracks_.utime = utime;
    tracks_.sequence = static_cast<std::int64_t>(frame.header.sequence);
    tracks_.left_out = static_cast<std::int32_t>(by_distance_.size() - count);
    tracks_.count = static_cast<std::int32_t>(count);
    tracks_.tracks.resize(count);
    for (std::size_t i = 0; i < count; ++i) fill(*by_distance_[i].second, tracks_.tracks[i]);
    sender_.send(tracks_channel_, tracks_);
}

void FramePublisher::publish_obstacles(const Frame& frame, std::int64_t utime) {
    const std::uint64_t sequence = frame.header.sequence;
    if (obstacles_sequence_ && sequence - *obstacles_sequence_ < obstacles_every_) return;
    obstacles_sequence_ = sequence;
    obstacles_->extract(frame, frame.odometry.T_world_sensor * T_sensor_base_.translation(), obstacles_message_);
    obstacles_message_.utime = utime;
    sender_.send(obstacles_channel_, obstacles_message_);
}

}  // namespace dlod::daemon
