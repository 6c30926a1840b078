#include "driver/frame_builder.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "driver/imu.hpp"

namespace dlod::driver {
namespace {

/// Packets of frames closed up to this many frames ago are stragglers; further back, the sensor has started anew.
constexpr std::int32_t kLateFrames = 16;
/// So many stragglers, and nothing else, are a capture played again or a sensor without init id that has restarted.
constexpr int kStragglersToBelieve = 64;
/// So many packets of another origin in a row, and none of ours: the sensor was exchanged or has a new address.
constexpr int kRivalPacketsToBelieve = 64;
/// So long after a restart packets of before it are taken for stragglers.
constexpr int kRetiredPackets = 64;
/// Beyond this a jump of frame ids says nothing about the number of frames lost.
constexpr std::int64_t kMaximumLostFrames = 1000;
/// Frames whose start is further from the sensor's rate, in turns, show a jump of its clock.
constexpr double kClockJump_turns = 0.5;

}  // namespace

FrameBuilder::FrameBuilder(const SensorInfo& info, const FrameBuilderConfig& config, Acquire acquire, Emit emit,
                           SeeImu see_imu)
    : info_(info),
      config_(config),
      acquire_(std::move(acquire)),
      emit_(std::move(emit)),
      see_imu_(std::move(see_imu)),
      layout_(info.layout()),
      decoder_(layout_, info.model),
      clock_(info.model.width, info.model.frame_period_s * 1e9, config.time_tolerance_turns),
      width_(info.model.width) {
    for (int m = 0; m < width_; ++m) window_columns_ += in_window(m) ? 1 : 0;
    for (Slot& slot : slots_) slot.columns.assign(static_cast<std::size_t>(width_), kMissing);
    closed_columns_.assign(static_cast<std::size_t>(width_), kMissing);
    headers_.resize(static_cast<std::size_t>(layout_.columns()));
    suspect_bytes_.resize(layout_.packet_bytes());
}

bool FrameBuilder::in_window(int measurement) const {
    const int first = info_.model.column_window_first;
    const int last = info_.model.column_window_last;
    if (first <= last) return measurement >= first && measurement <= last;
    return measurement >= first || measurement <= last;
}

void FrameBuilder::push(const Packet& packet) {
    ++counters_.packets;
    const bool to_imu_port = packet.destination_port == info_.imu_port && info_.imu_port != info_.lidar_port;
    if (packet.data.size() == layout_.packet_bytes()) {
        push_lidar(packet);
    } else if (packet.data.size() == kLegacyImuPacketBytes && info_.imu_profile_name == kLegacyImuProfile) {
        push_imu(packet);
    } else if (to_imu_port) {
        ++counters_.imu_unknown_packets;
    } else {
        ++counters_.wrong_size_packets;
    }
}

void FrameBuilder::push_imu(const Packet& packet) {
    if (sender_known_ && packet.sender_address != sender_) {
        ++counters_.foreign_packets;
        return;
    }
    const std::optional<ImuSample> sample = decode_imu_packet(packet.data);
    if (!sample) {
        ++counters_.imu_invalid_packets;
        return;
    }
    ++counters_.imu_packets;
    counters_.imu_rejected_samples.add(imu_.push(*sample));
    if (see_imu_) see_imu_(*sample);
}

void FrameBuilder::push_lidar(const Packet& packet) {
    LidarPacket lidar{packet.data, packet.receive_ns, layout_.read_packet_header(packet.data)};
    if (lidar.header.type != kLidarPacketType) {
        ++counters_.wrong_type_packets;
        return;
    }
    if (is_foreign(packet, lidar.header)) {
        ++counters_.foreign_packets;
        foreign_serial_.set(lidar.header.serial_number);
        return;
    }
    if (!read_columns(lidar)) {
        ++counters_.damaged_packets;
        return;
    }
    sender_known_ = true;
    sender_ = packet.sender_address;
    if (!route(lidar)) suspect(lidar);
}

bool FrameBuilder::is_foreign(const Packet& packet, const PacketHeader& header) {
    const bool has_serial = info_.format->serial_number.present();
    if (has_serial && info_.serial() != 0) return header.serial_number != info_.serial();
    Origin origin;
    if (has_serial) {
        origin.serial = header.serial_number;
    } else {
        origin.sender = packet.sender_address;
    }
    if (!origin_known_) origin_ = origin;
    origin_known_ = true;
    if (origin == origin_) {
        rival_packets_ = 0;
        return false;
    }
    rival_packets_ = origin == rival_ ? rival_packets_ + 1 : 1;
    rival_ = origin;
    if (rival_packets_ < kRivalPacketsToBelieve) return true;
    origin_ = origin;
    rival_packets_ = 0;
    return false;
}

/// Fills headers_ and packet.first_measurement; false when most of the packet's columns contradict each other.
bool FrameBuilder::read_columns(LidarPacket& packet) {
    // Columns of a packet are consecutive, so each one tells the first one's measurement: the majority is right.
    int votes = 0;
    for (int i = 0; i < layout_.columns(); ++i) {
        ColumnHeader& column = headers_[static_cast<std::size_t>(i)];
        column = layout_.read_column_header(packet.data, i);
        const int first = column.measurement_id - i;
        if (votes == 0) packet.first_measurement = first;
        votes += first == packet.first_measurement ? 1 : -1;
    }
    int trusted = 0;
    for (int i = 0; i < layout_.columns(); ++i) trusted += is_trusted(packet, i) ? 1 : 0;
    return packet.first_measurement >= 0 && 2 * trusted >= layout_.columns();
}

bool FrameBuilder::is_trusted(const LidarPacket& packet, int column) const {
    const ColumnHeader& header = headers_[static_cast<std::size_t>(column)];
    if (header.measurement_id != packet.first_measurement + column || header.measurement_id >= width_) return false;
    return !info_.format->column_frame_id.present() || header.frame_id == packet.header.frame_id;
}

FrameBuilder::ColumnState FrameBuilder::state_of(int column) const {
    return layout_.is_valid(headers_[static_cast<std::size_t>(column)]) ? kDecoded : kInvalid;
}

/// True when the packet's fate is settled, false when its frame or init id follows from nothing known.
bool FrameBuilder::route(const LidarPacket& packet) {
    if (!started_) return false;
    if (packet.header.init_id != init_id_) {
        if (retired_packets_left_ == 0 || packet.header.init_id != retired_init_id_) return false;
        --retired_packets_left_;
        ++counters_.late_packets;
        return true;
    }
    const std::int32_t distance = info_.format->frame_distance(frame_id_, packet.header.frame_id);
    if (distance < 0 && distance >= -kLateFrames && stragglers_ < kStragglersToBelieve) {
        ++stragglers_;
        count_straggler(packet, distance);
        return true;
    }
    if (distance != 0 && distance != 1) return false;
    stragglers_ = 0;
    retired_packets_left_ = std::max(0, retired_packets_left_ - 1);
    if (suspect_present_) {
        ++counters_.implausible_packets;
        suspect_present_ = false;
    }
    add(packet, slots_[static_cast<std::size_t>(distance)]);
    while (complete(slots_[0]) || complete(slots_[1]) || slots_[1].packets >= kPacketsToClose) advance();
    return true;
}

void FrameBuilder::count_straggler(const LidarPacket& packet, std::int32_t distance) {
    bool known = distance == -1;
    for (int i = 0; i < layout_.columns() && known; ++i) {
        known = !is_trusted(packet, i) ||
                closed_columns_[static_cast<std::size_t>(packet.first_measurement + i)] != kMissing;
    }
    ++(known ? counters_.duplicate_packets : counters_.late_packets);
}

void FrameBuilder::suspect(const LidarPacket& packet) {
    const std::int32_t distance = info_.format->frame_distance(suspect_.header.frame_id, packet.header.frame_id);
    const bool same_sensor = suspect_present_ && suspect_.header.init_id == packet.header.init_id;
    if (same_sensor && distance == 0 && packet.first_measurement == suspect_.first_measurement) {
        // Once more the same confirms nothing.
        ++counters_.duplicate_packets;
        return;
    }
    if (same_sensor && distance >= -1 && distance <= 1) {
        suspect_present_ = false;
        start_at(distance >= 0 ? suspect_.header.frame_id : packet.header.frame_id, packet.header.init_id);
        read_columns(suspect_);
        route(suspect_);
        LidarPacket confirming = packet;
        read_columns(confirming);
        route(confirming);
        return;
    }
    if (suspect_present_) ++counters_.implausible_packets;
    suspect_present_ = true;
    suspect_ = packet;
    std::copy(packet.data.begin(), packet.data.end(), suspect_bytes_.begin());
    suspect_.data = suspect_bytes_;
}

void FrameBuilder::start_at(std::uint32_t frame_id, std::uint32_t init_id) {
    const bool restarted = init_id != init_id_;
    if (started_) {
        ++(restarted ? counters_.restarts : counters_.frame_id_jumps);
        std::int64_t lost = restarted ? 0 : info_.format->frame_distance(frame_id_, frame_id);
        for (Slot& slot : slots_) {
            if (slot.packets == 0) continue;
            close(slot);
            --lost;
        }
        if (lost > 0 && lost <= kMaximumLostFrames) counters_.lost_frames.add(static_cast<std::uint64_t>(lost));
        if (restarted) {
            retired_init_id_ = init_id_;
            retired_packets_left_ = kRetiredPackets;
            imu_.clear();
            joined_in_turn_ = true;
        }
    }
    std::fill(closed_columns_.begin(), closed_columns_.end(), kMissing);
    previous_known_ = false;
    stragglers_ = 0;
    started_ = true;
    frame_id_ = frame_id;
    init_id_ = init_id;
}

void FrameBuilder::add(const LidarPacket& packet, Slot& slot) {
    bool fresh = false;
    for (int i = 0; i < layout_.columns(); ++i) {
        fresh = fresh || (is_trusted(packet, i) &&
                          slot.columns[static_cast<std::size_t>(packet.first_measurement + i)] < state_of(i));
    }
    if (!fresh) {
        ++counters_.duplicate_packets;
        return;
    }
    if (slot.packets == 0) {
        slot.frame = acquire_();
        slot.dropped = slot.frame == nullptr;
        if (slot.frame != nullptr) {
            Columns& columns = slot.frame->columns;
            std::fill(columns.time_ns.begin(), columns.time_ns.end(), 0);
            std::fill(columns.status.begin(), columns.status.end(), 0U);
            std::fill(columns.valid.begin(), columns.valid.end(), std::uint8_t{0});
        }
    }
    ++slot.packets;
    slot.receive_ns = packet.receive_ns;
    const bool next_has_begun = &slot == slots_.data() && slots_[1].packets > 0;
    if (packet.first_measurement < slot.last_measurement || next_has_begun) ++counters_.reordered_packets;
    slot.last_measurement = std::max(slot.last_measurement, packet.first_measurement);
    ++(slot.dropped ? counters_.dropped_packets : counters_.lidar_packets);
    add_columns(packet, slot);
}

void FrameBuilder::add_columns(const LidarPacket& packet, Slot& slot) {
    int run = 0;  // columns before i that are to be decoded together
    for (int i = 0; i <= layout_.columns(); ++i) {
        if (i < layout_.columns() && add_column(packet, i, slot)) {
            ++run;
        } else if (run > 0) {
            decoder_.decode(packet.data, i - run, run, packet.first_measurement + i - run, slot.frame->raw);
            run = 0;
        }
    }
}

/// Enters the column's header; true when its pixels are to be decoded.
bool FrameBuilder::add_column(const LidarPacket& packet, int column, Slot& slot) {
    if (!is_trusted(packet, column)) {
        ++counters_.misnumbered_columns;
        return false;
    }
    const int measurement = packet.first_measurement + column;
    const auto m = static_cast<std::size_t>(measurement);
    const ColumnState state = state_of(column);
    if (slot.columns[m] >= state) return false;
    if (in_window(measurement)) {
        if (slot.columns[m] == kMissing) ++slot.columns_in_window;
        if (state == kInvalid) ++counters_.invalid_columns;
    }
    slot.columns[m] = state;
    if (slot.frame == nullptr) return false;
    const ColumnHeader& header = headers_[static_cast<std::size_t>(column)];
    slot.frame->columns.time_ns[m] = ColumnClock::to_time(header.time_ns);
    slot.frame->columns.status[m] = header.status;
    slot.frame->columns.valid[m] = state == kDecoded ? 1 : 0;
    return state == kDecoded;
}

void FrameBuilder::advance() {
    if (slots_[0].packets > 0) {
        close(slots_[0]);
    } else {
        ++counters_.lost_frames;
        std::fill(closed_columns_.begin(), closed_columns_.end(), kMissing);
    }
    std::swap(slots_[0], slots_[1]);
    ++frame_id_;
}

/// Emits the slot's frame, if it has one, and makes the slot free.
void FrameBuilder::close(Slot& slot) {
    count_lost_packets(slot);
    if (slot.dropped) {
        ++counters_.dropped_frames;
        ++sequence_;
    } else {
        finish(*slot.frame, slot, &slot == slots_.data() ? frame_id_ : frame_id_ + 1);
        emit_(slot.frame);
    }
    joined_in_turn_ = false;
    closed_columns_.swap(slot.columns);
    std::fill(slot.columns.begin(), slot.columns.end(), kMissing);
    slot.frame = nullptr;
    slot.dropped = false;
    slot.packets = 0;
    slot.columns_in_window = 0;
    slot.last_measurement = -1;
}

void FrameBuilder::finish(Frame& frame, const Slot& slot, std::uint32_t frame_id) {
    decoder_.flush();
    counters_.mistimed_columns.add(static_cast<std::uint64_t>(clock_.reject(frame.columns)));
    clear_gaps(frame);

    FrameHeader& header = frame.header;
    header = FrameHeader{};
    header.sequence = sequence_++;
    header.frame_id = info_.format->frame_id_bits() == 16 ? frame_id & 0xFFFFU : frame_id;
    header.receive_ns = slot.receive_ns;
    for (std::size_t m = 0; m < frame.columns.valid.size(); ++m) {
        if (frame.columns.valid[m] == 0) continue;
        if (header.valid_columns == 0) header.first_stamp_ns = frame.columns.time_ns[m];
        header.stamp_ns = frame.columns.time_ns[m];
        ++header.valid_columns;
    }
    if (header.valid_columns == 0 && last_stamp_ns_ != 0) {
        // No column tells the time: a turn after the frame before.
        header.stamp_ns = last_stamp_ns_ + static_cast<std::int64_t>(info_.model.frame_period_s * 1e9);
        header.first_stamp_ns = header.stamp_ns;
    }
    last_stamp_ns_ = header.stamp_ns;
    header.usable = header.valid_columns > 0 && header.valid_columns >= config_.minimum_valid_share * window_columns_;
    frame.imu.clear();
    if (header.valid_columns > 0) {
        check_clock(frame_id);
        counters_.imu_rejected_samples.add(imu_.take(header.stamp_ns, frame.imu));
    }
    ++counters_.frames;
    if (header.valid_columns < window_columns_) ++counters_.incomplete_frames;
    if (!header.usable && !joined_in_turn_) ++counters_.unusable_frames;
}

void FrameBuilder::check_clock(std::uint32_t frame_id) {
    const double turn_ns = info_.model.frame_period_s * 1e9;
    const double expected_ns =
        previous_start_ns_ + turn_ns * info_.format->frame_distance(previous_frame_id_, frame_id);
    if (previous_known_ && std::abs(clock_.start_ns() - expected_ns) > kClockJump_turns * turn_ns) {
        ++counters_.clock_jumps;
    }
    previous_known_ = true;
    previous_start_ns_ = clock_.start_ns();
    previous_frame_id_ = frame_id;
}

/// Columns that were not written, or are not trusted, still hold the pixels of whichever frame was here before.
void FrameBuilder::clear_gaps(Frame& frame) const {
    int gap = 0;
    for (int m = 0; m <= width_; ++m) {
        if (m < width_ && frame.columns.valid[static_cast<std::size_t>(m)] == 0) {
            ++gap;
        } else if (gap > 0) {
            decoder_.clear(m - gap, gap, frame.raw);
            gap = 0;
        }
    }
}

void FrameBuilder::count_lost_packets(const Slot& slot) {
    const int columns = layout_.columns();
    std::uint64_t missing = 0;  // since the last packet that arrived
    bool any_arrived = false;
    for (int first = 0; first < width_; first += columns) {
        bool expected = false;
        bool arrived = false;
        for (int m = first; m < std::min(first + columns, width_); ++m) {
            expected = expected || in_window(m);
            arrived = arrived || slot.columns[static_cast<std::size_t>(m)] != kMissing;
        }
        if (arrived) {
            if (any_arrived || !joined_in_turn_) counters_.lost_packets.add(missing);
            any_arrived = true;
            missing = 0;
        } else if (expected) {
            ++missing;
        }
    }
    if (!ending_) counters_.lost_packets.add(missing);
}

void FrameBuilder::flush() {
    if (suspect_present_) {
        suspect_present_ = false;
        if (started_) {
            ++counters_.implausible_packets;
        } else {
            // A capture of a single packet: nothing speaks against it.
            start_at(suspect_.header.frame_id, suspect_.header.init_id);
            read_columns(suspect_);
            route(suspect_);
        }
    }
    while (slots_[0].packets > 0 || slots_[1].packets > 0) {
        ending_ = slots_[1].packets == 0;
        advance();
    }
    ending_ = false;
    started_ = false;
    joined_in_turn_ = true;
}

}  // namespace dlod::driver
