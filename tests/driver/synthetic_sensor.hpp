// A sensor made up for tests: its metadata, its packets, and what must come out of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "core/types/frame.hpp"
#include "driver/frame_builder.hpp"
#include "driver/metadata.hpp"
#include "driver/packet.hpp"

namespace dlod::driver::test {

struct SyntheticSetup {
    std::string profile = "RNG15_RFL8_NIR8";
    int rows = 16;
    int columns = 512;
    int columns_per_packet = 16;
    int frame_rate_hz = 10;
    int window_first = 0;
    int window_last = -1;  ///< -1: the last column
    std::string serial_number = "122201000998";
};

/// Metadata (nested layout) of such a sensor, as JSON.
std::string synthetic_metadata(const SyntheticSetup& setup);

/// Packets whose every pixel follows from frame id, row, measurement and field.
class SyntheticSensor {
  public:
    explicit SyntheticSensor(const SyntheticSetup& setup = {});

    const SensorInfo& info() const { return info_; }
    const PacketLayout& layout() const { return layout_; }
    int packets_per_frame() const { return info_.model.width / layout_.columns(); }

    /// Value of a field of a sent pixel, within the field's width.
    std::uint32_t value(std::uint32_t frame_id, int row, int measurement, PixelField field) const;
    std::int64_t time_ns(std::uint32_t frame_id, int measurement) const;
    std::vector<std::byte> packet(std::uint32_t frame_id, int index) const;
    /// Overwrites a column's header.
    void set_column(std::vector<std::byte>& packet, int column, const ColumnHeader& header) const;
    ColumnHeader column(const std::vector<std::byte>& packet, int column) const;

    std::uint64_t serial_number = 122201000998;
    std::uint32_t init_id = 0x123456;
    std::int64_t epoch_ns = 1'700'000'000'000'000'000;  ///< time of frame id 0, measurement 0

  private:
    SensorInfo info_;
    PacketLayout layout_;
};

/// What was emitted, kept as it was at that moment.
struct EmittedFrame {
    FrameHeader header;
    RawImages raw;
    Columns columns;
    std::vector<ImuSample> imu;
};

/// A frame builder with a pool of frames that are full of garbage whenever they are acquired.
class BuilderBench {
  public:
    explicit BuilderBench(const SyntheticSensor& sensor, FrameBuilderConfig config = {}, int frames = 3);

    void push(const std::vector<std::byte>& data);
    void push(const Packet& packet) { builder.push(packet); }
    /// All packets of a frame, or those of [first, last).
    void push_frame(std::uint32_t frame_id, int first = 0, int last = -1);

    /// Pixels of the emitted frame that differ from what was sent in valid columns, or from 0 in others.
    int wrong_pixels(const EmittedFrame& frame) const;
    const FrameBuilderCounters& counters() const { return builder.counters(); }
    /// Sum of all counters but those that tell of good data: 0 when nothing went wrong.
    std::uint64_t faults() const;

    std::vector<EmittedFrame> emitted;
    std::vector<Frame*> free_frames;  ///< take some out to starve the builder
    std::int64_t receive_ns = 0;      ///< of the packet pushed last; counts up
    std::uint16_t port;
    std::array<std::byte, 16> sender{};

  private:
    const SyntheticSensor& sensor_;
    std::vector<std::unique_ptr<Frame>> pool_;

  public:
    FrameBuilder builder;
};

}  // namespace dlod::driver::test
