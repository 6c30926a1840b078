#include "driver/frame_builder.hpp"

#include <algorithm>
#include <cmath>
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
constexpr std::int32_t kMaximumLostFrames = 1000;
/// Times from here on (year 2116) are no times, and would overflow signed arithmetic.
constexpr std::uint64_t kMaximumTime_ns = std::uint64_t{1} << 62U;
/// A column's time that is further from where both neighbours agree, in turns: isolated damage; motors are far
/// steadier.
constexpr double kIsolatedTime_turns = 0.002;
/// Frames whose start is further from the sensor's rate, in turns, show a jump of its clock.
constexpr double kClockJump_turns = 0.5;

}  // namespace

FrameBuilder::FrameBuilder(const SensorInfo& info, const FrameBuilderConfig& config, Acquire acquire, Emit emit)
    : info_(info),
      config_(config),
      acquire_(std::move(acquire)),
      emit_(std::move(emit)),
      layout_(info.layout()),
      decoder_(layout_, info.model),
      width_(info.model.width),
      window_columns_(0),
      column_period_ns_(info.model.frame_period_s * 1e9 / info.model.width) {
    for (int m = 0; m < width_; ++m) window_columns_ += in_window(m) ? 1 : 0;
    const auto columns = static_cast<std::size_t>(width_);
    for (Slot& slot : slots_) slot.columns.assign(columns, kMissing);
    closed_columns_.assign(columns, kMissing);
    time_error_ns_.assign(columns, 0.0);
    timed_columns_.reserve(columns);
    headers_.resize(static_cast<std::size_t>(layout_.columns()));
    suspect_.bytes.resize(layout_.packet_bytes());
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
    counters_.imu_rejected_samples += static_cast<std::uint64_t>(imu_.push(*sample));
}

void FrameBuilder::push_lidar(const Packet& packet) {
    const PacketHeader header = layout_.read_packet_header(packet.data);
    if (header.type != kLidarPacketType) {
        ++counters_.wrong_type_packets;
        return;
    }
    if (is_foreign(packet, header)) {
        ++counters_.foreign_packets;
        return;
    }
    if (read_columns(packet.data, header) < 0) {
        ++counters_.damaged_packets;
        return;
    }
    sender_known_ = true;
    sender_ = packet.sender_address;
    if (!route(packet.data, header, packet.receive_ns)) suspect(packet.data, header, packet.receive_ns);
}

bool FrameBuilder::is_foreign(const Packet& packet, const PacketHeader& header) {
    const bool has_serial = info_.format->serial_number.present();
    const std::uint64_t expected = has_serial ? info_.serial() : 0;
    if (expected != 0) {
        if (header.serial_number == expected) return false;
        foreign_serial_ = header.serial_number;
        return true;
    }
    Origin origin;
    if (has_serial) {
        origin.serial = header.serial_number;
    } else {
        origin.sender = packet.sender_address;
    }
    if (!origin_known_) {
        origin_known_ = true;
        origin_ = origin;
    }
    if (origin == origin_) {
        rival_packets_ = 0;
        return false;
    }
    rival_packets_ = origin == rival_ ? rival_packets_ + 1 : 1;
    rival_ = origin;
    if (rival_packets_ < kRivalPacketsToBelieve) {
        foreign_serial_ = header.serial_number;
        return true;
    }
    origin_ = origin;
    rival_packets_ = 0;
    return false;
}

int FrameBuilder::read_columns(std::span<const std::byte> data, const PacketHeader& header) {
    // Columns of a packet are consecutive: the first one's measurement follows from each, and the majority is right.
    int first = -1;
    int votes = 0;
    for (int i = 0; i < layout_.columns(); ++i) {
        headers_[static_cast<std::size_t>(i)] = layout_.read_column_header(data, i);
        const int candidate = headers_[static_cast<std::size_t>(i)].measurement_id - i;
        if (votes == 0) first = candidate;
        votes += candidate == first ? 1 : -1;
    }
    int trusted = 0;
    for (int i = 0; i < layout_.columns(); ++i) trusted += is_trusted(i, first, header) ? 1 : 0;
    const bool damaged = first < 0 || 2 * trusted < layout_.columns();
    return damaged ? -1 : first;
}

bool FrameBuilder::is_trusted(int column, int first_measurement, const PacketHeader& header) const {
    const ColumnHeader& h = headers_[static_cast<std::size_t>(column)];
    if (h.measurement_id != first_measurement + column || h.measurement_id >= width_) return false;
    return !info_.format->column_frame_id.present() || h.frame_id == header.frame_id;
}

bool FrameBuilder::route(std::span<const std::byte> data, const PacketHeader& header, std::int64_t receive_ns) {
    if (!started_) return false;
    if (header.init_id != init_id_) {
        if (retired_packets_left_ == 0 || header.init_id != retired_init_id_) return false;
        --retired_packets_left_;
        ++counters_.late_packets;
        return true;
    }
    const std::int32_t distance = info_.format->frame_distance(frame_id_, header.frame_id);
    if (distance < 0 && distance >= -kLateFrames && stragglers_ < kStragglersToBelieve) {
        ++stragglers_;
        count_straggler(data, header, distance);
        return true;
    }
    if (distance != 0 && distance != 1) return false;
    stragglers_ = 0;
    retired_packets_left_ = std::max(0, retired_packets_left_ - 1);
    if (suspect_.present) {
        ++counters_.implausible_packets;
        suspect_.present = false;
    }
    add(data, header, slots_[static_cast<std::size_t>(distance)], receive_ns);
    while (complete(slots_[0]) || complete(slots_[1]) || slots_[1].packets >= kPacketsToClose) advance();
    return true;
}

void FrameBuilder::count_straggler(std::span<const std::byte> data, const PacketHeader& header, std::int32_t distance) {
    const int first = read_columns(data, header);
    bool known = distance == -1;
    for (int i = 0; i < layout_.columns() && known; ++i) {
        known = !is_trusted(i, first, header) || closed_columns_[static_cast<std::size_t>(first + i)] != kMissing;
    }
    ++(known ? counters_.duplicate_packets : counters_.late_packets);
}

void FrameBuilder::suspect(std::span<const std::byte> data, const PacketHeader& header, std::int64_t receive_ns) {
    const int first = read_columns(data, header);
    const std::int32_t distance = info_.format->frame_distance(suspect_.header.frame_id, header.frame_id);
    const bool confirmed = suspect_.present && suspect_.header.init_id == header.init_id &&
                           (std::abs(distance) == 1 || (distance == 0 && first != suspect_.first_measurement));
    if (confirmed) {
        suspect_.present = false;
        start_at(distance >= 0 ? suspect_.header.frame_id : header.frame_id, header.init_id);
        route(suspect_.bytes, suspect_.header, suspect_.receive_ns);
        route(data, header, receive_ns);
        return;
    }
    if (suspect_.present) ++counters_.implausible_packets;
    suspect_.present = true;
    suspect_.header = header;
    suspect_.first_measurement = first;
    suspect_.receive_ns = receive_ns;
    std::copy(data.begin(), data.end(), suspect_.bytes.begin());
}

void FrameBuilder::start_at(std::uint32_t frame_id, std::uint32_t init_id) {
    if (started_) {
        const bool restarted = init_id != init_id_;
        ++(restarted ? counters_.restarts : counters_.frame_id_jumps);
        std::int32_t lost = restarted ? 0 : info_.format->frame_distance(frame_id_, frame_id);
        for (Slot& slot : slots_) {
            if (slot.packets == 0) continue;
            close(slot);
            --lost;
        }
        if (lost > 0 && lost <= kMaximumLostFrames) counters_.lost_frames += static_cast<std::uint64_t>(lost);
        if (restarted) {
            retired_init_id_ = init_id_;
            retired_packets_left_ = kRetiredPackets;
            imu_.clear();
            joined_in_turn_ = true;
        }
    }
    for (Slot& slot : slots_) reset(slot);
    std::fill(closed_columns_.begin(), closed_columns_.end(), kMissing);
    previous_known_ = false;
    stragglers_ = 0;
    started_ = true;
    frame_id_ = frame_id;
    init_id_ = init_id;
}

void FrameBuilder::add(std::span<const std::byte> data, const PacketHeader& header, Slot& slot,
                       std::int64_t receive_ns) {
    const int first = read_columns(data, header);
    bool fresh = false;
    for (int i = 0; i < layout_.columns(); ++i) {
        if (!is_trusted(i, first, header)) {
            ++counters_.misnumbered_columns;
            continue;
        }
        fresh = fresh || slot.columns[static_cast<std::size_t>(first + i)] < arrived_state(i);
    }
    if (!fresh) {
        ++counters_.duplicate_packets;
        return;
    }
    if (slot.packets == 0) {
        slot.frame = acquire_();
        if (slot.frame == nullptr) {
            slot.dropped = true;
        } else {
            prepare(*slot.frame);
        }
    }
    ++slot.packets;
    slot.receive_ns = receive_ns;
    if (first < slot.last_measurement || (&slot == slots_.data() && slots_[1].packets > 0))
        ++counters_.reordered_packets;
    slot.last_measurement = std::max(slot.last_measurement, first);
    ++(slot.dropped ? counters_.dropped_packets : counters_.lidar_packets);
    add_columns(data, header, first, slot);
}

void FrameBuilder::add_columns(std::span<const std::byte> data, const PacketHeader& header, int first, Slot& slot) {
    int run = 0;  // columns before i that are to be decoded together
    for (int i = 0; i <= layout_.columns(); ++i) {
        bool decoded = false;
        if (i < layout_.columns() && is_trusted(i, first, header)) {
            const auto m = static_cast<std::size_t>(first + i);
            const ColumnHeader& column = headers_[static_cast<std::size_t>(i)];
            const ColumnState arrived = arrived_state(i);
            if (slot.columns[m] == kMissing && in_window(first + i)) ++slot.columns_in_window;
            if (slot.columns[m] < arrived) {
                slot.columns[m] = arrived;
                decoded = arrived == kDecoded && slot.frame != nullptr;
                if (arrived == kInvalid && in_window(first + i)) ++counters_.invalid_columns;
                if (slot.frame != nullptr) {
                    const bool possible = column.time_ns < kMaximumTime_ns;
                    slot.frame->columns.time_ns[m] = possible ? static_cast<std::int64_t>(column.time_ns) : -1;
                    slot.frame->columns.status[m] = column.status;
                    slot.frame->columns.valid[m] = arrived == kDecoded ? 1 : 0;
                }
            }
        }
        if (decoded) {
            ++run;
        } else if (run > 0) {
            decoder_.decode(data, i - run, run, first + i - run, slot.frame->raw);
            run = 0;
        }
    }
}

FrameBuilder::ColumnState FrameBuilder::arrived_state(int column) const {
    return layout_.is_valid(headers_[static_cast<std::size_t>(column)]) ? kDecoded : kInvalid;
}

void FrameBuilder::prepare(Frame& frame) const {
    std::fill(frame.columns.time_ns.begin(), frame.columns.time_ns.end(), 0);
    std::fill(frame.columns.status.begin(), frame.columns.status.end(), 0U);
    std::fill(frame.columns.valid.begin(), frame.columns.valid.end(), std::uint8_t{0});
}

void FrameBuilder::advance() {
    if (slots_[0].packets > 0) {
        close(slots_[0]);
    } else {
        ++counters_.lost_frames;
        std::fill(closed_columns_.begin(), closed_columns_.end(), kMissing);
    }
    reset(slots_[0]);
    std::swap(slots_[0], slots_[1]);
    ++frame_id_;
}

void FrameBuilder::reset(Slot& slot) {
    slot.frame = nullptr;
    slot.dropped = false;
    slot.packets = 0;
    slot.columns_in_window = 0;
    slot.last_measurement = -1;
    slot.receive_ns = 0;
    std::fill(slot.columns.begin(), slot.columns.end(), kMissing);
}

void FrameBuilder::close(Slot& slot) {
    const std::uint32_t id = &slot == slots_.data() ? frame_id_ : frame_id_ + 1;
    count_lost_packets(slot);
    joined_in_turn_ = false;
    std::copy(slot.columns.begin(), slot.columns.end(), closed_columns_.begin());
    if (slot.dropped) {
        ++counters_.dropped_frames;
        return;
    }
    Frame& frame = *slot.frame;
    reject_mistimed(frame.columns, id);
    clear_gaps(frame);

    FrameHeader& header = frame.header;
    header = FrameHeader{};
    header.sequence = sequence_++;
    header.frame_id = id & static_cast<std::uint32_t>((std::uint64_t{1} << info_.format->frame_id_bits()) - 1);
    header.receive_ns = slot.receive_ns;
    for (int m = 0; m < width_; ++m) {
        const auto i = static_cast<std::size_t>(m);
        if (frame.columns.valid[i] == 0) continue;
        if (header.valid_columns++ == 0) header.first_stamp_ns = frame.columns.time_ns[i];
        header.stamp_ns = frame.columns.time_ns[i];
    }
    header.usable = header.valid_columns > 0 && header.valid_columns >= config_.minimum_valid_share * window_columns_;
    frame.imu.clear();
    if (header.valid_columns > 0) {
        counters_.imu_rejected_samples += static_cast<std::uint64_t>(imu_.take(header.stamp_ns, frame.imu));
    }
    ++counters_.frames;
    if (header.valid_columns < window_columns_) ++counters_.incomplete_frames;
    if (!header.usable) ++counters_.unusable_frames;
    emit_(std::exchange(slot.frame, nullptr));
}

void FrameBuilder::reject_mistimed(Columns& columns, std::uint32_t frame_id) {
    const double turn_ns = column_period_ns_ * width_;
    const double tolerance_ns = config_.time_tolerance_turns * turn_ns;
    int count = 0;
    int first = -1;
    int last = -1;
    for (int m = 0; m < width_; ++m) {
        if (columns.valid[static_cast<std::size_t>(m)] == 0) continue;
        if (first < 0) first = m;
        last = m;
        ++count;
    }
    if (count == 0) return;
    const auto time_at = [&](int m) { return static_cast<double>(columns.time_ns[static_cast<std::size_t>(m)]); };
    // The turn's start that most columns agree on (majority vote with a tolerance), and how many agree.
    const auto agree = [&](double period_ns) {
        double start = 0.0;
        int votes = 0;
        int support = 0;
        for (int m = 0; m < width_; ++m) {
            if (columns.valid[static_cast<std::size_t>(m)] == 0) continue;
            const double candidate = time_at(m) - m * period_ns;
            if (votes == 0) start = candidate;
            votes += std::abs(candidate - start) <= tolerance_ns ? 1 : -1;
        }
        for (int m = 0; m < width_; ++m) {
            if (columns.valid[static_cast<std::size_t>(m)] == 0) continue;
            support += std::abs(time_at(m) - m * period_ns - start) <= tolerance_ns ? 1 : 0;
        }
        return std::pair{start, support};
    };
    double period_ns = column_period_ns_;
    auto [start, support] = agree(period_ns);
    if (2 * support < count && last > first) {
        // The sensor may turn at another rate than its metadata says.
        const double measured_ns = (time_at(last) - time_at(first)) / (last - first);
        const auto [measured_start, measured_support] = agree(measured_ns);
        if (measured_ns > 0.0 && measured_support > support) {
            period_ns = measured_ns;
            start = measured_start;
        }
    }
    const auto reject = [&](int m) {
        const auto i = static_cast<std::size_t>(m);
        counters_.mistimed_columns += columns.valid[i];
        columns.valid[i] = 0;
        columns.time_ns[i] = 0;
    };
    timed_columns_.clear();
    for (int m = 0; m < width_; ++m) {
        const auto i = static_cast<std::size_t>(m);
        time_error_ns_[i] = time_at(m) - m * period_ns - start;
        if (columns.time_ns[i] == 0) continue;
        if (std::abs(time_error_ns_[i]) > tolerance_ns || columns.time_ns[i] < 0) {
            reject(m);
        } else if (columns.valid[i] != 0) {
            timed_columns_.push_back(m);
        }
    }
    reject_isolated(columns, kIsolatedTime_turns * turn_ns);

    const auto turns = static_cast<double>(info_.format->frame_distance(previous_frame_id_, frame_id));
    if (previous_known_ && std::abs(start - previous_start_ns_ - turns * turn_ns) > kClockJump_turns * turn_ns) {
        ++counters_.clock_jumps;
    }
    previous_known_ = true;
    previous_start_ns_ = start;
    previous_frame_id_ = frame_id;
}

void FrameBuilder::reject_isolated(Columns& columns, double tolerance_ns) {
    // A median of three: where a column's two nearest agree with each other but not with it, it is wrong.
    const std::size_t count = timed_columns_.size();
    for (std::size_t k = 0; count >= 3 && k < count; ++k) {
        const std::size_t centre = std::clamp<std::size_t>(k, 1, count - 2);
        const auto error = [&](std::size_t at) { return time_error_ns_[static_cast<std::size_t>(timed_columns_[at])]; };
        const double own = error(k);
        const double one = error(k == centre - 1 ? centre : centre - 1);
        const double other = error(k == centre + 1 ? centre : centre + 1);
        if (std::abs(one - other) > tolerance_ns) continue;
        if (std::abs(own - one) <= tolerance_ns || std::abs(own - other) <= tolerance_ns) continue;
        const auto m = static_cast<std::size_t>(timed_columns_[k]);
        ++counters_.mistimed_columns;
        columns.valid[m] = 0;
        columns.time_ns[m] = 0;
    }
}

void FrameBuilder::clear_gaps(Frame& frame) const {
    int gap = 0;  // columns before m that hold an earlier frame's pixels
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
    std::uint64_t pending = 0;  // missing since the last packet that arrived
    bool any_arrived = false;
    for (int first = 0; first < width_; first += columns) {
        bool expected = false;
        bool arrived = false;
        for (int m = first; m < std::min(first + columns, width_); ++m) {
            expected = expected || in_window(m);
            arrived = arrived || slot.columns[static_cast<std::size_t>(m)] != kMissing;
        }
        if (arrived) {
            if (any_arrived || !joined_in_turn_) counters_.lost_packets += pending;
            any_arrived = true;
            pending = 0;
        } else if (expected) {
            ++pending;
        }
    }
    if (!ending_) counters_.lost_packets += pending;
}

void FrameBuilder::flush() {
    if (suspect_.present && !started_) {
        start_at(suspect_.header.frame_id, suspect_.header.init_id);
        suspect_.present = false;
        route(suspect_.bytes, suspect_.header, suspect_.receive_ns);
    }
    if (suspect_.present) ++counters_.implausible_packets;
    suspect_.present = false;
    while (slots_[0].packets > 0 || slots_[1].packets > 0) {
        ending_ = slots_[1].packets == 0;
        advance();
    }
    ending_ = false;
    started_ = false;
    joined_in_turn_ = true;
}

}  // namespace dlod::driver
