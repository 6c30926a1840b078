#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "daemon/clock/host_time_filter.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/config/config_file.hpp"
#include "daemon/output/result_writer.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/publish/frame_publisher.hpp"
#include "daemon/publish/lcm_bus.hpp"
#include "daemon/recorder/recording_source.hpp"
#include "daemon/service/log.hpp"
#include "daemon/service/notifier.hpp"
#include "daemon/service/signals.hpp"
#include "daemon/service/thread_setup.hpp"
#include "daemon/status/status_board.hpp"
#include "driver/udp_source.hpp"

namespace dlod::daemon {
namespace {

constexpr auto kStatusPeriod = std::chrono::seconds(1);

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

std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::string describe(const driver::SensorInfo& sensor) {
    return fmt::format("{} {} {} {} {}", sensor.product_line, sensor.serial_number, sensor.firmware, sensor.lidar_mode,
                       sensor.profile_name);
}

/// Reloads the configuration: what can change in a running service does, what cannot is named, and a file with errors
/// changes nothing.
void reload(const ConfigSources& sources, const driver::SensorInfo& sensor, Config& running) {
    try {
        Config fresh = load_config(sources, &sensor);
        const auto changed = list_options(fresh);
        const auto current = list_options(running);
        for (std::size_t i = 0; i < changed.size(); ++i) {
            const auto* option = std::get_if<Option>(&changed[i]);
            if (option == nullptr || option->to_yaml() == std::get<Option>(current[i]).to_yaml()) continue;
            if (option->key == "log.level") {
                running.log.level = fresh.log.level;
                set_up_log(running.log.level);
                spdlog::info("reload: log.level is now {}", option->to_yaml());
            } else {
                spdlog::warn("reload: {} takes effect at the next restart", option->key);
            }
        }
    } catch (const ConfigError& error) {
        spdlog::error("reload: {}; the running configuration stays in force", error.what());
    }
}

}  // namespace

ExitCode run(const RunArguments& arguments) {
    Config config = load_config(arguments.config, nullptr);
    if (config.sensor.metadata.empty())
        throw ConfigError("sensor.metadata: needed for a live run: the sensor's metadata file");
    const auto sensor = driver::load_metadata(config.sensor.metadata);
    config = load_config(arguments.config, &sensor);
    set_up_log(config.log.level);
    for (const auto& warning : sensor.warnings) spdlog::warn("{}", warning);

    SignalWaiter signals;
    driver::UdpSource socket(udp_options(config.sensor, sensor));
    std::unique_ptr<RecordingSource> recording;
    if (!config.recording.folder.empty()) {
        recording = std::make_unique<RecordingSource>(socket, config.recording, text_of(config.sensor.metadata));
    }
    driver::PacketSource& source = recording ? static_cast<driver::PacketSource&>(*recording) : socket;
    std::unique_ptr<LcmBus> bus;
    std::unique_ptr<FramePublisher> publisher;
    std::unique_ptr<MessageSender> status_sender;
    if (config.lcm.url != "none") {
        bus = std::make_unique<LcmBus>(config.lcm.url);
        publisher = std::make_unique<FramePublisher>(*bus, sensor.model, config.extrinsics.T_base_sensor(),
                                                     config.lcm.channel_prefix);
        status_sender = std::make_unique<MessageSender>(*bus);
    }
    std::unique_ptr<ResultWriter> writer;
    if (!config.output.folder.empty()) {
        writer = std::make_unique<ResultWriter>(config.output.folder, static_cast<TimingClock>(config.output.timing));
    }

    const auto monotonic_ns = [] { return StepTimer::now_ns(CLOCK_MONOTONIC); };
    StatusBoard board(DLOD_VERSION, describe(sensor), monotonic_ns());
    HostTimeFilter host_time;
    FrameSinks sinks;
    if (publisher) {
        sinks.publish = [&, sensor_time = config.lcm.utime_source == 1](PipelineFrame& frame) {
            host_time.add(frame.header.stamp_ns, frame.header.receive_ns);
            const std::int64_t stamp_ns =
                sensor_time ? frame.header.stamp_ns : host_time.next_stamp_ns(frame.header.stamp_ns);
            publisher->publish(frame, stamp_ns / 1000);
        };
    }
    if (writer) sinks.write = [&](PipelineFrame& frame) { writer->write(frame); };
    sinks.finished = [&](const PipelineFrame& frame) { board.add(frame, monotonic_ns()); };
    Pipeline pipeline(sensor, config.method, config.frames, source, std::move(sinks),
                      {.threads = config.pipeline.threads,
                       .waiting_frames = config.pipeline.waiting_frames,
                       .live = true,
                       .on_thread_start = [&config](int i) {
                           const bool worker = i < config.pipeline.threads;
                           set_up_thread(worker ? fmt::format("dlod-{}", i).c_str() : "dlod-receive", config.pipeline);
                       }});
    lock_memory(config.pipeline);
    pipeline.start();
    const ServiceNotifier service;
    service.ready("waiting for packets");
    spdlog::info("receiving on port {}, {}", fmt::join(socket.ports(), " and "), describe(sensor));

    RepeatedWarnings warnings;
    std::int8_t last_health = status_t::WAITING;
    const auto report = [&] {
        CounterList counters;
        const driver::CounterVisitor collect = [&](std::string_view name, std::uint64_t value) {
            counters.emplace_back(name, value);
        };
        source.visit_counters(collect);
        pipeline.ingest().counters().visit(collect);
        collect("pipeline_dropped_frames", pipeline.dropped_frames());
        if (publisher) collect("lcm_failed", publisher->failed() + status_sender->failed());
        const auto& status = board.compose(counters, pipeline.ingest().last_packet_ns(), monotonic_ns(),
                                           StepTimer::now_ns(CLOCK_REALTIME) / 1000);
        if (status_sender) status_sender->send(config.lcm.channel_prefix + "STATUS", status);
        service.status(board.one_line());
        if (status.health != last_health || status.health == status_t::DEGRADED) {
            last_health = status.health;
            if (status.health == status_t::OK) {
                spdlog::info("{}", board.one_line());
            } else {
                warnings.warn(fmt::format("health {}", status.health), board.one_line());
            }
        }
    };

    bool stopping = false;
    auto next_report = std::chrono::steady_clock::now() + kStatusPeriod;
    while (!pipeline.done()) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(next_report - std::chrono::steady_clock::now());
        switch (signals.wait(pipeline.done_descriptor(), std::max(left, std::chrono::milliseconds(0)))) {
            case SignalWaiter::Event::kStop:
                if (!std::exchange(stopping, true)) {
                    service.stopping();
                    pipeline.stop();
                }
                break;
            case SignalWaiter::Event::kReload:
                service.reloading();
                reload(arguments.config, sensor, config);
                service.ready(board.one_line());
                break;
            case SignalWaiter::Event::kDescriptor:
            case SignalWaiter::Event::kTimeout:
                break;
        }
        if (std::chrono::steady_clock::now() < next_report) continue;
        next_report += kStatusPeriod;
        report();
        if (pipeline.moves_on()) service.watchdog();
    }
    pipeline.rethrow_failure();
    if (writer) {
        pipeline.map().finish();
        writer->finish(pipeline.map().points());
    }
    spdlog::info("stopped after {} frames, {} dropped", pipeline.finished_frames(), pipeline.dropped_frames());
    return ExitCode::kSuccess;
}

}  // namespace dlod::daemon
