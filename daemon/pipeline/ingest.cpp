#include "daemon/pipeline/ingest.hpp"

#include <spdlog/spdlog.h>

namespace dlod::daemon {

Ingest::Ingest(driver::PacketSource& source, const driver::SensorInfo& sensor, const driver::FrameBuilderConfig& config,
               FramePool& pool, FrameQueue& out, IntakeStage& intake, EventCount& events, Options options)
    : source_(source),
      pool_(pool),
      out_(out),
      intake_(intake),
      events_(events),
      options_(std::move(options)),
      builder_(
          sensor, config, [this] { return acquire(); }, [this](Frame* frame) { emit(frame); }, options_.imu) {}

void Ingest::run() {
    const std::uint64_t before = emitted_frames();
    start_clocks();
    while (emitted_frames() == before && ready()) {
        if (!step()) break;
    }
    charge_clocks();
}

void Ingest::run_until_end() {
    while (true) {
        // Drawn before anything is looked at: what happens from here on ends the wait.
        const auto ticket = events_.ticket();
        if (ended() || abandoned_.load()) return;
        if (!options_.live && !ready()) {
            events_.wait(ticket);
            continue;
        }
        const std::uint64_t before = emitted_frames();
        start_clocks();
        step();
        charge_clocks();
        if (ended() || emitted_frames() != before) events_.notify();
    }
}

/// One packet, or a new batch. @return false where there is nothing to go on with now
bool Ingest::step() {
    if (next_packet_ == batch_.packets.size()) {
        batch_ = source_.next();
        ++steps_;
        next_packet_ = 0;
        if (options_.paced) wall_start_ns_ = StepTimer::now_ns(CLOCK_MONOTONIC);
        log_warnings();
        if (batch_.status == driver::SourceStatus::kEnd || batch_.status == driver::SourceStatus::kStopped) {
            builder_.flush();
            ended_.store(true);
            return false;
        }
        if (batch_.packets.empty()) return false;
        last_packet_ns_.store(StepTimer::now_ns(CLOCK_MONOTONIC), std::memory_order_relaxed);
    }
    // Live, the whole batch at once: nothing waits for frames. Replay, packet by packet: each may need some.
    do {
        builder_.push(batch_.packets[next_packet_++]);
    } while (options_.live && next_packet_ < batch_.packets.size());
    return true;
}

Frame* Ingest::acquire() {
    PipelineFrame* frame = pool_.acquire();
    if (frame == nullptr && options_.live) {
        frame = intake_.steal();
        // A worker may have found the stage claimed and gone to sleep.
        events_.notify();
    }
    return frame;
}

void Ingest::emit(Frame* frame) {
    auto* const emitted = static_cast<PipelineFrame*>(frame);
    charge_clocks();
    emitted->times = std::exchange(times_, {});
    emitted->emitted_ns = StepTimer::now_ns(CLOCK_MONOTONIC);
    emitted->received_ns = emitted->emitted_ns - queueing_ns(*frame);
    emitted_.store(emitted_frames() + 1);
    out_.push(emitted);
}

/// How long the last packet of a frame waited in the kernel.
std::int64_t Ingest::queueing_ns(const Frame& frame) const {
    if (!options_.live) return 0;
    // Beyond a few seconds it is no delay, but the clock was set in between, or the stamps are not of this host's time.
    constexpr std::int64_t kPlausible_ns = 10'000'000'000;
    const std::int64_t delay_ns = StepTimer::now_ns(CLOCK_REALTIME) - frame.header.receive_ns;
    return delay_ns > 0 && delay_ns < kPlausible_ns ? delay_ns : 0;
}

void Ingest::start_clocks() {
    wall_start_ns_ = StepTimer::now_ns(CLOCK_MONOTONIC);
    cpu_start_ns_ = StepTimer::now_ns(CLOCK_THREAD_CPUTIME_ID);
}

void Ingest::charge_clocks() {
    const auto step = static_cast<std::size_t>(Step::kIngest);
    const std::int64_t wall_ns = std::exchange(wall_start_ns_, StepTimer::now_ns(CLOCK_MONOTONIC));
    const std::int64_t cpu_ns = std::exchange(cpu_start_ns_, StepTimer::now_ns(CLOCK_THREAD_CPUTIME_ID));
    times_.wall_ms[step] += static_cast<float>(1e-6 * static_cast<double>(wall_start_ns_ - wall_ns));
    times_.cpu_ms[step] += static_cast<float>(1e-6 * static_cast<double>(cpu_start_ns_ - cpu_ns));
}

void Ingest::log_warnings() {
    for (const auto& warning : source_.take_warnings()) spdlog::warn("{}", warning);
    if (const std::uint64_t serial = builder_.foreign_serial(); serial != 0 && !foreign_warned_) {
        foreign_warned_ = true;
        spdlog::warn(
            "packets of the sensor with serial number {} are not used: the metadata are those of another sensor; "
            "to use it, give its metadata",
            serial);
    }
}

}  // namespace dlod::daemon
