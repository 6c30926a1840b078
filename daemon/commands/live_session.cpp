#include "daemon/commands/live_session.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon/service/thread_setup.hpp"

namespace dlod::daemon {
namespace {

driver::UdpOptions udp_options(const SensorConfig& config, const driver::SensorInfo& sensor) {
    const auto port = [](int configured, std::uint16_t other) {
        return configured != 0 ? static_cast<std::uint16_t>(configured) : other;
    };
    driver::UdpOptions options;
    options.ports = {port(config.lidar_port, sensor.lidar_port), port(config.imu_port, sensor.imu_port)};
    options.bind_address = config.bind_address;
    options.multicast_group = config.multicast_group;
    options.multicast_interface = config.interface;
    if (!config.sender.empty()) options.senders = {config.sender};
    options.share_ports = config.share_ports;
    options.forward_to = config.forward_to;
    options.receive_buffer_bytes = config.receive_buffer_bytes;
    return options;
}

std::string describe(const driver::SensorInfo& sensor) {
    return fmt::format("{} {} {} {} {}", sensor.product_line, sensor.serial_number, sensor.firmware, sensor.lidar_mode,
                       sensor.profile_name);
}

PipelineOptions pipeline_options(const PipelineConfig& config) {
    return {.threads = config.threads,
            .waiting_frames = config.waiting_frames,
            .live = true,
            .on_thread_start = [config](int i) {
                set_up_thread(i < config.threads ? fmt::format("dlod-{}", i).c_str() : "dlod-receive", config);
            }};
}

std::unique_ptr<RecordingSource> make_recording(const RecordingConfig& config, driver::PacketSource& socket,
                                                const std::string& metadata) {
    return config.folder.empty() ? nullptr : std::make_unique<RecordingSource>(socket, config, metadata);
}

std::unique_ptr<LcmBus> make_bus(const LcmConfig& config) {
    return config.url == "none" ? nullptr : std::make_unique<LcmBus>(config.url);
}

std::unique_ptr<ResultWriter> make_writer(const OutputConfig& config) {
    if (config.folder.empty()) return nullptr;
    return std::make_unique<ResultWriter>(config.folder, static_cast<TimingClock>(config.timing));
}

std::int64_t monotonic_ns() {
    return StepTimer::now_ns(CLOCK_MONOTONIC);
}

}  // namespace

LiveSession::LiveSession(const Config& config, const driver::SensorInfo& sensor, const std::string& metadata)
    : config_(config),
      description_(describe(sensor)),
      socket_(udp_options(config.sensor, sensor)),
      recording_(make_recording(config.recording, socket_, metadata)),
      bus_(make_bus(config.lcm)),
      publisher_(bus_ ? std::make_unique<FramePublisher>(*bus_, sensor.model, config.extrinsics.T_base_sensor(),
                                                         config.lcm.channel_prefix)
                      : nullptr),
      status_sender_(bus_ ? std::make_unique<MessageSender>(*bus_) : nullptr),
      writer_(make_writer(config.output)),
      board_(DLOD_VERSION, description_, monotonic_ns()),
      pipeline_(sensor, config.method, config.frames, source(), sinks(), pipeline_options(config.pipeline)) {}

FrameSinks LiveSession::sinks() {
    return {.publish = [this](PipelineFrame& frame) { publish(frame); },
            .write = [this](PipelineFrame& frame) { write(frame); },
            .finished = [this](const PipelineFrame& frame) { board_.add(frame, monotonic_ns()); }};
}

void LiveSession::start() {
    lock_memory(config_.pipeline);
    pipeline_.start();
    service_.ready("waiting for packets");
    spdlog::info("receiving on port {}, {}", fmt::join(socket_.ports(), " and "), description_);
}

void LiveSession::publish(const PipelineFrame& frame) {
    if (!publisher_) return;
    host_time_.add(frame.header.stamp_ns, frame.header.receive_ns);
    report_clock_step();
    const bool sensor_time = config_.lcm.utime_source == 1;
    const std::int64_t stamp_ns = sensor_time ? frame.header.stamp_ns : host_time_.next_stamp_ns(frame.header.stamp_ns);
    publisher_->publish(frame, stamp_ns / 1000);
}

void LiveSession::report_clock_step() {
    const auto step = host_time_.take_step();
    if (!step.happened) return;
    warnings_.warn("clock step",
                   fmt::format("the clocks of host and sensor moved by {:.3f} s against each other; utime {}",
                               1e-9 * static_cast<double>(step.by_ns),
                               step.followed ? "follows" : "stays on the old scale, as it never goes back"));
}

/// A service lives on when its disk is full.
void LiveSession::write(PipelineFrame& frame) {
    if (!writer_) return;
    try {
        writer_->write(frame);
    } catch (const OutputError& error) {
        spdlog::error("{}; no more result files are written", error.what());
        ++output_failures_;
        writer_.reset();
    }
}

CounterList LiveSession::counters() {
    CounterList counters;
    const driver::CounterVisitor collect = [&](std::string_view name, std::uint64_t value) {
        counters.emplace_back(name, value);
    };
    source().visit_counters(collect);
    pipeline_.ingest().counters().visit(collect);
    collect("pipeline_dropped_frames", pipeline_.dropped_frames());
    if (publisher_) collect("lcm_failed", publisher_->failed() + status_sender_->failed());
    collect("output_failures", output_failures_.value());
    return counters;
}

void LiveSession::report() {
    const auto& status = board_.compose(counters(), pipeline_.ingest().last_packet_ns(), monotonic_ns(),
                                        StepTimer::now_ns(CLOCK_REALTIME) / 1000);
    if (status_sender_) status_sender_->send(config_.lcm.channel_prefix + "STATUS", status);
    service_.status(board_.one_line());
    log_health(status);
    if (pipeline_.moves_on()) service_.watchdog();
}

void LiveSession::log_health(const status_t& status) {
    const bool changed = std::exchange(last_health_, status.health) != status.health;
    if (status.health == status_t::OK) {
        if (changed) spdlog::info("{}", board_.one_line());
    } else if (changed || status.health == status_t::DEGRADED) {
        warnings_.warn(fmt::format("health {}", status.health), board_.one_line());
    }
}

void LiveSession::finish() {
    pipeline_.rethrow_failure();
    if (writer_) {
        pipeline_.map().finish();
        writer_->finish(pipeline_.map().points());
    }
    spdlog::info("stopped after {} frames, {} dropped", pipeline_.finished_frames(), pipeline_.dropped_frames());
}

}  // namespace dlod::daemon
