#include "daemon/commands/live_session.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <string_view>
#include <utility>

#include "daemon/control/command_actions.hpp"
#include "daemon/sensor/udp_options.hpp"
#include "daemon/service/thread_setup.hpp"

namespace dlod::daemon {
namespace {

PipelineOptions pipeline_options(const Config& config) {
    return {.threads = config.pipeline.threads,
            .waiting_frames = config.pipeline.waiting_frames,
            .live = true,
            .body = {config.extrinsics.T_base_sensor(), config.robot_body.boxes()},
            .on_thread_start = [pipeline = config.pipeline](int i) {
                set_up_thread(i < pipeline.threads ? fmt::format("dlod-{}", i).c_str() : "dlod-receive", pipeline);
            }};
}

/// Live, nothing waits for who takes messages.
constexpr std::chrono::milliseconds kNoPatience{0};

std::unique_ptr<SessionMessages> make_messages(const Config& config, const driver::SensorInfo& sensor) {
    if (config.lcm.url == "none") return nullptr;
    return std::make_unique<SessionMessages>(config.lcm, sensor, config.method.odometry.motion,
                                             config.extrinsics.T_base_sensor(), kNoPatience,
                                             [pipeline = config.pipeline] { set_up_thread("dlod-predict", pipeline); });
}

/// A large map on a slow disk takes longer than a stop otherwise may.
constexpr std::chrono::seconds kTimeToSave{60};
/// No packet for so long: the sensor is asked why.
constexpr std::int64_t kSilence_ns = 2'000'000'000;
/// Packets that do not fit the metadata, or whose sensor has started anew: it may be another one.
constexpr std::string_view kUnfitCounters[] = {"wrong_size_packets", "wrong_type_packets", "foreign_packets",
                                               "damaged_packets",    "unusable_frames",    "restarts",
                                               "frame_id_jumps",     "clock_jumps"};

std::int64_t monotonic_ns() {
    return StepTimer::now_ns(CLOCK_MONOTONIC);
}

}  // namespace

LiveSession::LiveSession(const Config& config, const driver::SensorInfo& sensor, const std::string& metadata,
                         const LiveStart& start)
    : config_(config),
      utime_is_sensor_time_(config.lcm.utime_source == 1),
      description_(sensor.description()),
      start_(start),
      socket_(udp_options(config.sensor, sensor)),
      recording_(socket_, config.recording, metadata),
      messages_(make_messages(config, sensor)),
      maps_(config.saved_maps),
      host_time_(start.host_time),
      board_(DLOD_VERSION, description_, start.start_ns),
      pipeline_(sensor, config.method, config.frames, recording_, sinks(), pipeline_options(config)) {
    open_results();
}

FrameSinks LiveSession::sinks() {
    return {.imu =
                [this](const ImuSample& sample) {
                    if (messages_) messages_->publish_predicted_pose(sample);
                },
            .publish_pose = [this](PipelineFrame& frame) { publish_pose(frame); },
            .publish =
                [this](PipelineFrame& frame) {
                    if (messages_) messages_->publish(frame, frame.utime_us);
                },
            .write = [this](PipelineFrame& frame) { write(frame); },
            .finished = [this](const PipelineFrame& frame) { board_.add(frame, monotonic_ns()); }};
}

void LiveSession::start() {
    lock_memory(config_.pipeline);
    pipeline_.start();
    if (messages_) {
        messages_->announce_sensor(monotonic_ns(), StepTimer::now_ns(CLOCK_REALTIME) / 1000);
        control_ = RemoteControl::listen(config_.lcm, pipeline_actions(maps_, pipeline_), board_, messages_->bus());
    }
    service_.ready("waiting for packets");
    spdlog::info("receiving on port {}, {}", fmt::join(socket_.ports(), " and "), description_);
}

void LiveSession::publish_pose(PipelineFrame& frame) {
    if (!messages_) return;
    host_time_.add(frame.header.stamp_ns, frame.header.receive_ns);
    report_clock_step();
    const std::int64_t stamp_ns =
        utime_is_sensor_time_ ? frame.header.stamp_ns : host_time_.next_stamp_ns(frame.header.stamp_ns);
    frame.utime_us = stamp_ns / 1000;
    messages_->publish_pose(frame, frame.utime_us);
}

void LiveSession::report_clock_step() {
    const auto step = host_time_.take_step();
    if (!step.happened) return;
    // Either way is news of its own.
    warnings_.warn(step.by_ns > 0 ? "clock step forward" : "clock step back",
                   fmt::format("the clocks of host and sensor moved by {:.3f} s against each other; utime {}",
                               1e-9 * static_cast<double>(step.by_ns),
                               step.followed    ? "follows"
                               : step.by_ns > 0 ? "stays, and is nearer to the host's time again"
                                                : "stays on the old scale, as it never goes back"));
}

/// Each session has a folder of its own: one that another sensor ended keeps its results.
void LiveSession::open_results() {
    if (config_.output.folder.empty()) return;
    const std::string suffix = start_.sessions_before == 0 ? "" : fmt::format("-{}", start_.sessions_before + 1);
    try {
        writer_ = std::make_unique<ResultWriter>(config_.output.folder + suffix,
                                                 static_cast<TimingClock>(config_.output.timing));
    } catch (const OutputError& error) {
        if (!start_.is_service) throw;
        spdlog::error("{}; no result files are written", error.what());
        ++output_failures_;
    }
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

void LiveSession::finish_results() {
    try {
        writer_->finish(pipeline_.map().points());
    } catch (const OutputError& error) {
        if (!start_.is_service) throw;
        spdlog::error("{}; the result files are not complete", error.what());
    }
}

/// A map that cannot be saved does not make the stop unclean.
void LiveSession::save_last_map() {
    const auto result = maps_.save("last", pipeline_.map().snapshot());
    spdlog::log(result.ok ? spdlog::level::info : spdlog::level::err, "map at the stop: {}", result.text);
}

CounterList LiveSession::counters() {
    CounterList counters;
    const driver::CounterVisitor collect = [&](std::string_view name, std::uint64_t value) {
        counters.emplace_back(name, value);
    };
    recording_.visit_counters(collect);
    pipeline_.ingest().counters().visit(collect);
    collect("pipeline_dropped_frames", pipeline_.dropped_frames());
    if (messages_) collect("lcm_failed", messages_->failed());
    if (control_) control_->visit_counters(collect);
    collect("restarts_of_odometry", pipeline_.restarts());
    collect("output_failures", output_failures_.value());
    collect("sensor_changes", start_.sessions_before);
    return counters;
}

void LiveSession::report(const std::string& sensor_trouble) {
    const CounterList totals = counters();
    const std::int64_t now_ns = monotonic_ns();
    const std::int64_t utime = StepTimer::now_ns(CLOCK_REALTIME) / 1000;
    board_.set_sensor_trouble(sensor_trouble);
    const status_t status = board_.compose(totals, pipeline_.ingest().last_packet_ns(), now_ns, utime);
    if (messages_) {
        messages_->announce_sensor(now_ns, utime);
        messages_->send(status);
    }
    service_.status(board_.one_line());
    log_health(status);
    judge_stream(totals, now_ns);
    if (pipeline_.moves_on()) service_.watchdog();
}

void LiveSession::judge_stream(const CounterList& counters, std::int64_t now_ns) {
    std::uint64_t unfit = 0;
    for (const auto& [name, value] : counters) {
        if (std::find(std::begin(kUnfitCounters), std::end(kUnfitCounters), name) != std::end(kUnfitCounters)) {
            unfit += value;
        }
    }
    const std::int64_t last_ns = pipeline_.ingest().last_packet_ns();
    if (last_ns == 0 || now_ns - last_ns > kSilence_ns) {
        stream_ = SensorWatch::Stream::kSilent;
    } else {
        stream_ = unfit > unfit_packets_ ? SensorWatch::Stream::kUnfit : SensorWatch::Stream::kGood;
    }
    unfit_packets_ = unfit;
}

void LiveSession::configure(const Config& config) {
    if (config.recording != config_.recording) recording_.configure(config.recording);
    config_ = config;
}

LiveStart LiveSession::next_start() const {
    return {.start_ns = start_.start_ns,
            .sessions_before = start_.sessions_before + 1,
            .host_time = host_time_.for_another_sensor(),
            .is_service = start_.is_service};
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
    control_.reset();
    pipeline_.rethrow_failure();
    if (writer_ || config_.saved_maps.at_stop) {
        service_.allow(kTimeToSave);
        pipeline_.map().finish();
    }
    if (config_.saved_maps.at_stop) save_last_map();
    if (writer_) finish_results();
    spdlog::info("stopped after {} frames, {} dropped", pipeline_.finished_frames(), pipeline_.dropped_frames());
}

}  // namespace dlod::daemon
