#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <utility>

#include "daemon/commands/capture_metadata.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/commands/replay_messages.hpp"
#include "daemon/output/result_writer.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/service/log.hpp"
#include "daemon/service/signals.hpp"
#include "driver/paced_source.hpp"
#include "driver/pcap_source.hpp"
#include "driver/port_selection.hpp"

namespace dlod::daemon {
namespace {

using Clock = std::chrono::steady_clock;

/// A line on a terminal that shows how far the replay is; nothing elsewhere.
class ProgressBar {
  public:
    void show(double share, std::uint64_t frames, double seconds) {
        if (!terminal_) return;
        constexpr int kWidth = 40;
        const int filled = static_cast<int>(share * kWidth);
        std::fprintf(stderr, "\r[%.*s%*s] %3.0f %%  %llu frames  %.0f/s ", filled,
                     "########################################", kWidth - filled, "", 100.0 * share,
                     static_cast<unsigned long long>(frames),
                     seconds > 0.0 ? static_cast<double>(frames) / seconds : 0.0);
    }
    void finish() {
        if (terminal_) std::fputs("\n", stderr);
    }

  private:
    bool terminal_ = ::isatty(STDERR_FILENO) == 1;
};

/// Ports as configured, else as the metadata says, else those that the sensor's packets go to.
std::vector<std::uint16_t> capture_ports(const std::filesystem::path& capture, const driver::SensorInfo& sensor,
                                         const SensorConfig& config) {
    const auto or_else = [](int configured, std::uint16_t other) {
        return configured != 0 ? static_cast<std::uint16_t>(configured) : other;
    };
    const auto selected = driver::select_ports(capture, {.lidar_port = or_else(config.lidar_port, sensor.lidar_port),
                                                         .imu_port = or_else(config.imu_port, sensor.imu_port),
                                                         .lidar_bytes = sensor.layout().packet_bytes()});
    for (const auto& warning : selected.warnings) spdlog::warn("{}", warning);
    return {selected.lidar_port, selected.imu_port};
}

/// Totals of the run, for people.
class Summary {
  public:
    void add(const PipelineFrame& frame) {
        ++frames_;
        valid_poses_ += frame.odometry.valid ? 1 : 0;
        for (std::size_t i = 0; i < kStepCount; ++i) {
            wall_ms_[i] += static_cast<double>(frame.times.wall_ms[i]);
            cpu_ms_[i] += static_cast<double>(frame.times.cpu_ms[i]);
        }
    }
    void print(const Pipeline& pipeline, const driver::PacketSource& source, double seconds) const {
        std::printf("%llu frames, %llu valid poses, %.2f s, %.1f frames/s\n", static_cast<unsigned long long>(frames_),
                    static_cast<unsigned long long>(valid_poses_), seconds, static_cast<double>(frames_) / seconds);
        if (frames_ > 0) print_steps();
        std::printf("packets:");
        const driver::CounterVisitor print_counter = [](std::string_view name, std::uint64_t value) {
            if (value != 0)
                std::printf(" %.*s %llu", static_cast<int>(name.size()), name.data(),
                            static_cast<unsigned long long>(value));
        };
        source.visit_counters(print_counter);
        pipeline.ingest().counters().visit(print_counter);
        std::printf("\n");
    }

  private:
    void print_steps() const {
        std::printf("%-14s %9s %9s\n", "step", "wall ms", "CPU ms");
        double total = 0.0;
        for (std::size_t i = 0; i < kStepCount; ++i) {
            const double n = static_cast<double>(frames_);
            std::printf("%-14s %9.3f %9.3f\n", kStepNames[i], wall_ms_[i] / n, cpu_ms_[i] / n);
            total += cpu_ms_[i] / n;
        }
        std::printf("%-14s %9s %9.3f\n", "total", "", total);
    }

    std::uint64_t frames_ = 0;
    std::uint64_t valid_poses_ = 0;
    std::array<double, kStepCount> wall_ms_{};
    std::array<double, kStepCount> cpu_ms_{};
};

}  // namespace

ExitCode replay(const ReplayArguments& arguments) {
    const auto sensor = load_capture_metadata(arguments.capture, arguments.metadata);
    const Config config = load_config(arguments.config, &sensor);
    set_up_log(config.log.level);
    for (const auto& warning : sensor.warnings) spdlog::warn("{}", warning);

    const auto ports = capture_ports(arguments.capture, sensor, config.sensor);
    auto capture =
        std::make_unique<driver::PcapSource>(arguments.capture, driver::PcapOptions{.ports = ports, .reassembly = {}});
    const driver::PcapSource& progress_of = *capture;
    driver::PacedSource source(std::move(capture), arguments.rate);
    std::unique_ptr<ResultWriter> writer;
    if (!config.output.folder.empty()) {
        writer = std::make_unique<ResultWriter>(config.output.folder, static_cast<TimingClock>(config.output.timing));
    }

    SignalWaiter signals;  // before any thread
    std::unique_ptr<ReplayMessages> messages;
    if (!config.lcm.url.empty() && config.lcm.url != "none") {
        messages = std::make_unique<ReplayMessages>(config, sensor);
    }

    Summary summary;
    FrameSinks sinks;
    if (messages) {
        sinks.imu = [&](const ImuSample& sample) { messages->publish_predicted_pose(sample); };
        sinks.publish_pose = [&](PipelineFrame& frame) { messages->publish_pose(frame); };
        sinks.publish = [&](PipelineFrame& frame) { messages->publish(frame); };
    }
    if (writer) sinks.write = [&](PipelineFrame& frame) { writer->write(frame); };
    sinks.finished = [&](const PipelineFrame& frame) {
        summary.add(frame);
        if (messages) messages->add(frame);
    };
    const auto start = Clock::now();
    const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    Pipeline pipeline(sensor, config.method, config.frames, source, std::move(sinks),
                      {.threads = config.pipeline.threads,
                       .paced = arguments.rate > 0.0,
                       .body = {config.extrinsics.T_base_sensor(), config.robot_body.boxes()}});
    pipeline.start();
    if (messages) messages->listen(pipeline);

    ProgressBar progress;
    bool interrupted = false;
    while (!pipeline.done()) {
        const auto event = signals.wait(pipeline.done_descriptor(), std::chrono::milliseconds(200));
        progress.show(progress_of.progress(), pipeline.finished_frames(), elapsed());
        if (messages) messages->report_if_due(pipeline, source);
        // There is nothing to reload: SIGHUP tells that the terminal has gone.
        if (event == SignalWaiter::Event::kStop || event == SignalWaiter::Event::kReload) {
            interrupted = true;
            pipeline.stop();
        }
    }
    progress.finish();
    if (messages) {
        messages->stop_listening();
        messages->report(pipeline, source);
        if (messages->failed() > 0) spdlog::warn("{} LCM messages could not be sent", messages->failed());
    }
    pipeline.rethrow_failure();
    if (writer) {
        pipeline.map().finish();
        writer->finish(pipeline.map().points());
    }
    summary.print(pipeline, source, elapsed());
    return interrupted ? ExitCode::kInterrupted : ExitCode::kSuccess;
}

}  // namespace dlod::daemon
