// Packets in, whole frames out.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"
#include "driver/imu_queue.hpp"
#include "driver/metadata.hpp"
#include "driver/packet.hpp"
#include "driver/pixel_decoder.hpp"

namespace dlod::driver {

struct FrameBuilderConfig {
    /// A frame with a smaller share of its window's columns is emitted, but not used by the odometry.
    double minimum_valid_share = 0.4;
    /// A column whose time is further from the frame's course of time is not trusted.
    double time_tolerance_turns = 0.25;

    template <class V>
    void visit(V& v) {
        v.parameter("minimum_valid_share", minimum_valid_share, Range{0.0, 1.0}, "",
                    "share of the column window that must have arrived for odometry to use a frame; higher: safer, and "
                    "more frames only predicted when packets are lost");
        v.parameter("time_tolerance_turns", time_tolerance_turns, Range{0.01, 1.0}, "turns",
                    "how far a column's time may be off the frame's other columns; higher: trusts odder clocks");
    }
};

/// What became of the packets. Every datagram that is pushed counts in `packets` and in exactly one of those marked *.
struct FrameBuilderCounters {
    std::uint64_t packets = 0;
    std::uint64_t lidar_packets = 0;         ///< * decoded into a frame
    std::uint64_t imu_packets = 0;           ///< * decoded
    std::uint64_t duplicate_packets = 0;     ///< * all columns had arrived before
    std::uint64_t late_packets = 0;          ///< * of a frame that has been closed
    std::uint64_t wrong_size_packets = 0;    ///< * neither of the lidar profile's size nor of an IMU packet's
    std::uint64_t wrong_type_packets = 0;    ///< * right size, but the header says that it is no lidar packet
    std::uint64_t foreign_packets = 0;       ///< * of another sensor (serial number, or sender where there is none)
    std::uint64_t implausible_packets = 0;   ///< * frame or init id fits neither what came before nor what came after
    std::uint64_t damaged_packets = 0;       ///< * not one column could be used for its measurement id
    std::uint64_t dropped_packets = 0;       ///< * no free frame was there to decode into
    std::uint64_t imu_unknown_packets = 0;   ///< * IMU packets of a format that is not decoded
    std::uint64_t imu_invalid_packets = 0;   ///< * IMU values that are no measurement
    std::uint64_t imu_rejected_samples = 0;  ///< decoded, but twice, at an absurd time or too many for one frame

    std::uint64_t reordered_packets = 0;    ///< of lidar_packets: came after a later one
    std::uint64_t lost_packets = 0;         ///< missing in emitted frames (not before the first, after the last packet)
    std::uint64_t invalid_columns = 0;      ///< the sensor itself marked them invalid
    std::uint64_t misnumbered_columns = 0;  ///< measurement id contradicts the rest of the packet
    std::uint64_t mistimed_columns = 0;     ///< time contradicts the rest of the frame
    std::uint64_t clock_jumps = 0;          ///< between frames, against the sensor's rate
    std::uint64_t restarts = 0;             ///< the sensor's init id changed
    std::uint64_t frame_id_jumps = 0;       ///< frame ids went on elsewhere

    std::uint64_t frames = 0;             ///< emitted
    std::uint64_t incomplete_frames = 0;  ///< of frames: with gaps
    std::uint64_t unusable_frames = 0;    ///< of frames: too few valid columns for odometry
    std::uint64_t lost_frames = 0;        ///< frame ids of which nothing arrived
    std::uint64_t dropped_frames = 0;     ///< arrived when no free frame was there

    /// Calls v(name, value) for each, in this order.
    template <class V>
    void visit(V&& v) const {
        v("packets", packets);
        v("lidar_packets", lidar_packets);
        v("imu_packets", imu_packets);
        v("duplicate_packets", duplicate_packets);
        v("late_packets", late_packets);
        v("wrong_size_packets", wrong_size_packets);
        v("wrong_type_packets", wrong_type_packets);
        v("foreign_packets", foreign_packets);
        v("implausible_packets", implausible_packets);
        v("damaged_packets", damaged_packets);
        v("dropped_packets", dropped_packets);
        v("imu_unknown_packets", imu_unknown_packets);
        v("imu_invalid_packets", imu_invalid_packets);
        v("imu_rejected_samples", imu_rejected_samples);
        v("reordered_packets", reordered_packets);
        v("lost_packets", lost_packets);
        v("invalid_columns", invalid_columns);
        v("misnumbered_columns", misnumbered_columns);
        v("mistimed_columns", mistimed_columns);
        v("clock_jumps", clock_jumps);
        v("restarts", restarts);
        v("frame_id_jumps", frame_id_jumps);
        v("frames", frames);
        v("incomplete_frames", incomplete_frames);
        v("unusable_frames", unusable_frames);
        v("lost_frames", lost_frames);
        v("dropped_frames", dropped_frames);
    }
};

/// Decodes packets straight into the frame under construction and the one after it, so that packets which were
/// reordered across the edge need not be kept aside. A frame is emitted on the packet that completes its column window,
/// or else after kPacketsToClose packets of the next one. Whatever the packets hold, nothing is written outside of the
/// frames, and a frame or init id that does not follow from what came before is believed only when a second packet
/// confirms it: strangers and damaged packets close no good frame.
class FrameBuilder {
  public:
    /// A free frame of the sensor's size, or nullptr when there is none.
    using Acquire = std::function<Frame*()>;
    /// Takes over a finished frame.
    using Emit = std::function<void(Frame*)>;

    static constexpr int kPacketsToClose = 4;

    FrameBuilder(const SensorInfo& info, const FrameBuilderConfig& config, Acquire acquire, Emit emit);

    /// Handles one datagram, lidar or IMU or anything else; the frame that it completes is emitted before this returns.
    void push(const Packet& packet);

    /// Emits what is under construction: at the end of a capture.
    void flush();

    const FrameBuilderCounters& counters() const { return counters_; }
    /// Serial number in the last foreign packet, 0 if there was none: for telling the user whose metadata is needed.
    std::uint64_t foreign_serial() const { return foreign_serial_; }

  private:
    enum ColumnState : std::uint8_t { kMissing = 0, kInvalid = 1, kDecoded = 2 };

    /// A frame under construction.
    struct Slot {
        Frame* frame = nullptr;
        bool dropped = false;  ///< its packets are not decoded, for want of a frame
        int packets = 0;
        int columns_in_window = 0;
        int last_measurement = -1;  ///< highest that has arrived
        std::int64_t receive_ns = 0;
        std::vector<std::uint8_t> columns;  ///< [W] ColumnState
    };

    /// Who sends: the serial number, or the sender's address where packets carry none.
    struct Origin {
        std::uint64_t serial = 0;
        std::array<std::byte, 16> sender{};
        friend bool operator==(const Origin&, const Origin&) = default;
    };

    /// A packet whose frame or init id came out of nowhere, kept until the next one confirms or refutes it.
    struct Suspect {
        bool present = false;
        PacketHeader header;
        int first_measurement = 0;
        std::int64_t receive_ns = 0;
        std::vector<std::byte> bytes;
    };

    void push_lidar(const Packet& packet);
    void push_imu(const Packet& packet);
    bool is_foreign(const Packet& packet, const PacketHeader& header);
    /// Fills headers_ and returns the measurement id of column 0, or -1 when the packet's columns contradict each
    /// other.
    int read_columns(std::span<const std::byte> data, const PacketHeader& header);
    bool is_trusted(int column, int first_measurement, const PacketHeader& header) const;
    ColumnState arrived_state(int column) const;

    /// True when the packet's fate is settled, false when its frame or init id follows from nothing known.
    bool route(std::span<const std::byte> data, const PacketHeader& header, std::int64_t receive_ns);
    void suspect(std::span<const std::byte> data, const PacketHeader& header, std::int64_t receive_ns);
    void start_at(std::uint32_t frame_id, std::uint32_t init_id);
    void count_straggler(std::span<const std::byte> data, const PacketHeader& header, std::int32_t distance);
    void add(std::span<const std::byte> data, const PacketHeader& header, Slot& slot, std::int64_t receive_ns);
    void add_columns(std::span<const std::byte> data, const PacketHeader& header, int first, Slot& slot);

    bool complete(const Slot& slot) const { return slot.columns_in_window == window_columns_; }
    bool in_window(int measurement) const;
    void advance();
    void close(Slot& slot);
    void reset(Slot& slot);
    void prepare(Frame& frame) const;
    void reject_mistimed(Columns& columns, std::uint32_t frame_id);
    void reject_isolated(Columns& columns, double tolerance_ns);
    void clear_gaps(Frame& frame) const;
    void count_lost_packets(const Slot& slot);

    SensorInfo info_;
    FrameBuilderConfig config_;
    Acquire acquire_;
    Emit emit_;
    PacketLayout layout_;
    PixelDecoder decoder_;
    int width_;
    int window_columns_;
    double column_period_ns_;

    FrameBuilderCounters counters_;
    std::array<Slot, 2> slots_;                 ///< the frame `frame_id_` and the one after it
    std::vector<std::uint8_t> closed_columns_;  ///< ColumnState of the frame closed last
    std::vector<ColumnHeader> headers_;         ///< of the packet at hand
    Suspect suspect_;
    std::vector<double> time_error_ns_;  ///< [W] by measurement, against the course of the frame at hand
    std::vector<int> timed_columns_;     ///< measurements whose time is believed

    bool started_ = false;
    bool joined_in_turn_ = true;  ///< no frame closed since the start: what is missing at its beginning was not lost
    bool ending_ = false;         ///< the last frame of a capture: what is missing at its end was not lost
    std::uint32_t frame_id_ = 0;
    std::uint32_t init_id_ = 0;
    std::uint32_t retired_init_id_ = 0;  ///< before the last restart: its stragglers are no further restart
    int retired_packets_left_ = 0;
    int stragglers_ = 0;  ///< in a row
    bool sender_known_ = false;
    std::array<std::byte, 16> sender_{};  ///< of the lidar packets: the IMU's must come from there, too
    bool origin_known_ = false;
    Origin origin_;
    Origin rival_;  ///< foreign origin seen last
    int rival_packets_ = 0;
    std::uint64_t foreign_serial_ = 0;

    ImuQueue imu_;
    std::uint64_t sequence_ = 0;
    bool previous_known_ = false;
    double previous_start_ns_ = 0.0;  ///< time of measurement 0 of the frame closed last, by its clock
    std::uint32_t previous_frame_id_ = 0;
};

}  // namespace dlod::driver
