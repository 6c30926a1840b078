// Packets in, whole frames out.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"
#include "driver/column_clock.hpp"
#include "driver/frame_builder_counters.hpp"
#include "driver/imu_queue.hpp"
#include "driver/metadata.hpp"
#include "driver/packet.hpp"
#include "driver/pixel_decoder.hpp"

namespace dlod::driver {

struct FrameBuilderConfig {
    double minimum_valid_share = 0.25;
    double time_tolerance_turns = 0.05;

    template <class V>
    void visit(V& v) {
        v.parameter("minimum_valid_share", minimum_valid_share, Range{0.0, 1.0}, "",
                    "share of the column window that must have arrived for odometry to use a frame; higher: safer, but "
                    "more frames are only predicted when packets are lost");
        v.parameter("time_tolerance_turns", time_tolerance_turns, Range{0.01, 1.0}, "turns",
                    "how far a column's time may be off the course of the frame's other columns; higher: trusts odder "
                    "clocks");
    }
};

/// Decodes packets straight into the frame under construction and the one after it, so that packets which were
/// reordered across the edge need not be kept aside. A frame is emitted on the packet that completes its column window,
/// or else after kPacketsToClose packets of the next one. Whatever the packets hold, nothing is written outside of the
/// frames, and a frame or init id that does not follow from what came before is believed only when a second packet
/// confirms it: strangers and damaged packets close no good frame. Allocates nothing once it is made.
class FrameBuilder {
  public:
    /// A free frame of the sensor's size, or nullptr when there is none. Called at most twice ahead of an emission.
    using Acquire = std::function<Frame*()>;
    /// Takes over a finished frame.
    using Emit = std::function<void(Frame*)>;

    /// Sees each reading of the sensor's IMU as it comes, before its frame.
    using SeeImu = std::function<void(const ImuSample&)>;

    static constexpr int kPacketsToClose = 4;

    FrameBuilder(const SensorInfo& info, const FrameBuilderConfig& config, Acquire acquire, Emit emit,
                 SeeImu see_imu = {});
    FrameBuilder(const FrameBuilder&) = delete;
    FrameBuilder& operator=(const FrameBuilder&) = delete;

    /// Handles one datagram, lidar or IMU or anything else; the frame that it completes is emitted before this returns.
    void push(const Packet& packet);

    /// Emits what is under construction: at the end of a capture.
    void flush();

    const FrameBuilderCounters& counters() const { return counters_; }
    /// Serial number in the last foreign packet, 0 if there was none: for telling the user whose metadata is needed.
    std::uint64_t foreign_serial() const { return foreign_serial_.value(); }

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

    /// A lidar packet of the right size, type and origin; its column headers are in headers_.
    struct LidarPacket {
        std::span<const std::byte> data;
        std::int64_t receive_ns = 0;
        PacketHeader header;
        int first_measurement = 0;  ///< of column 0; the others follow
    };

    /// Who sends: the serial number, or the sender's address where packets carry none.
    struct Origin {
        std::uint64_t serial = 0;
        std::array<std::byte, 16> sender{};
        friend bool operator==(const Origin&, const Origin&) = default;
    };

    void push_lidar(const Packet& packet);
    void push_imu(const Packet& packet);
    bool is_foreign(const Packet& packet, const PacketHeader& header);
    bool read_columns(LidarPacket& packet);
    bool is_trusted(const LidarPacket& packet, int column) const;
    ColumnState state_of(int column) const;

    bool route(const LidarPacket& packet);
    void suspect(const LidarPacket& packet);
    void start_at(std::uint32_t frame_id, std::uint32_t init_id);
    void count_straggler(const LidarPacket& packet, std::int32_t distance);
    void add(const LidarPacket& packet, Slot& slot);
    void add_columns(const LidarPacket& packet, Slot& slot);
    bool add_column(const LidarPacket& packet, int column, Slot& slot);

    bool in_window(int measurement) const;
    bool complete(const Slot& slot) const { return slot.columns_in_window == window_columns_; }
    void advance();
    void close(Slot& slot);
    void finish(Frame& frame, const Slot& slot, std::uint32_t frame_id);
    void check_clock(std::uint32_t frame_id);
    void clear_gaps(Frame& frame) const;
    void count_lost_packets(const Slot& slot);

    SensorInfo info_;
    FrameBuilderConfig config_;
    Acquire acquire_;
    Emit emit_;
    SeeImu see_imu_;
    PacketLayout layout_;
    PixelDecoder decoder_;
    ColumnClock clock_;
    ImuQueue imu_;
    int width_;
    int window_columns_ = 0;
    FrameBuilderCounters counters_;

    std::vector<ColumnHeader> headers_;         ///< of the packet at hand
    std::array<Slot, 2> slots_;                 ///< the frame frame_id_ and the one after it
    std::vector<std::uint8_t> closed_columns_;  ///< ColumnState of the frame before them
    std::uint64_t sequence_ = 0;                ///< of the next frame: those that are dropped count, too
    std::int64_t last_stamp_ns_ = 0;            ///< of the frame emitted last

    bool started_ = false;
    bool joined_in_turn_ = true;  ///< no frame closed since the start: what is missing at its beginning was not lost
    bool ending_ = false;         ///< the last frame of a capture: what is missing at its end was not lost
    std::uint32_t frame_id_ = 0;
    std::uint32_t init_id_ = 0;

    /// A packet whose frame or init id came out of nowhere waits here until the next one confirms or refutes it.
    bool suspect_present_ = false;
    LidarPacket suspect_;
    std::vector<std::byte> suspect_bytes_;

    int stragglers_ = 0;                 ///< in a row
    std::uint32_t retired_init_id_ = 0;  ///< before the last restart: its stragglers are no further restart
    int retired_packets_left_ = 0;

    bool origin_known_ = false;
    Origin origin_;
    Origin rival_;  ///< foreign origin seen last
    int rival_packets_ = 0;
    Counter foreign_serial_;
    bool sender_known_ = false;
    std::array<std::byte, 16> sender_{};  ///< of the lidar packets: the IMU's must come from there, too

    bool previous_known_ = false;
    double previous_start_ns_ = 0.0;  ///< of the frame closed last, by its clock
    std::uint32_t previous_frame_id_ = 0;
};

}  // namespace dlod::driver
