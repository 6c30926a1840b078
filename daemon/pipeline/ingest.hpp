// Packets from the source into frames, frames into the pipeline.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "daemon/pipeline/frame_pool.hpp"
#include "daemon/pipeline/stage.hpp"
#include "driver/counter.hpp"
#include "driver/frame_builder.hpp"
#include "driver/packet_source.hpp"

namespace dlod::daemon {

/// An actor where the source never waits (replay at full speed); else run_until_end() on a thread of its own.
class Ingest final : public Actor {
  public:
    struct Options {
        bool live = false;   ///< never wait for a free frame: drop the oldest one that waits
        bool paced = false;  ///< the source waits for packets: that is not counted as time of ingest
        std::function<void(const ImuSample&)> imu = {};  ///< called with each reading of the IMU, as it comes
    };

    Ingest(driver::PacketSource& source, const driver::SensorInfo& sensor, const driver::FrameBuilderConfig& config,
           FramePool& pool, FrameQueue& out, IntakeStage& intake, EventCount& events, Options options);

    bool ready() const override {
        return !ended() && pool_.available() >= kFramesAtWork && out_.read_available() < kMaxWaiting;
    }
    /// Goes on until a frame was emitted or frames are short.
    void run() override;
    /// Goes on to the end of the source, or until abandon().
    void run_until_end();
    /// Nothing takes frames any more: makes run_until_end() return. From any thread.
    void abandon() {
        abandoned_.store(true);
        events_.notify();
    }

    bool ended() const { return ended_.load(); }
    std::uint64_t emitted_frames() const { return emitted_.load(); }
    /// The frame builder's; from any thread.
    const driver::FrameBuilderCounters& counters() const { return builder_.counters(); }
    /// Counts the source's answers, also those without packets: it stands still where the source hangs. From any
    /// thread.
    std::uint64_t steps() const { return steps_.value(); }
    /// CLOCK_MONOTONIC of the last packet; 0: none yet. From any thread.
    std::int64_t last_packet_ns() const { return last_packet_ns_.load(std::memory_order_relaxed); }

  private:
    /// A packet may close one frame and begin two.
    static constexpr std::size_t kFramesAtWork = 2;
    /// Replay builds no further ahead: what waits is only cold memory.
    static constexpr std::size_t kMaxWaiting = 1;

    bool step();
    Frame* acquire();
    void emit(Frame* frame);
    std::int64_t queueing_ns(const Frame& frame) const;
    void start_clocks();
    void charge_clocks();
    void log_warnings();

    driver::PacketSource& source_;
    FramePool& pool_;
    FrameQueue& out_;
    IntakeStage& intake_;
    EventCount& events_;
    Options options_;
    driver::FrameBuilder builder_;
    driver::PacketBatch batch_;
    std::size_t next_packet_ = 0;
    bool foreign_warned_ = false;
    StageTimes times_;
    std::int64_t wall_start_ns_ = 0;
    std::int64_t cpu_start_ns_ = 0;
    std::atomic<std::uint64_t> emitted_{0};
    driver::Counter steps_;
    std::atomic<std::int64_t> last_packet_ns_{0};
    std::atomic<bool> ended_{false};
    std::atomic<bool> abandoned_{false};
};

}  // namespace dlod::daemon
