#include "daemon/commands/replay_messages.hpp"

#include <chrono>

#include "daemon/control/command_actions.hpp"

namespace dlod::daemon {
namespace {

constexpr std::int64_t kReportPeriod_ns = 1'000'000'000;
/// A replay is as fast as who takes its messages, while they are taken.
constexpr std::chrono::seconds kPatience{2};

std::int64_t monotonic_ns() {
    return StepTimer::now_ns(CLOCK_MONOTONIC);
}

}  // namespace

ReplayMessages::ReplayMessages(const Config& config, const driver::SensorInfo& sensor)
    : config_(config.lcm),
      maps_(config.saved_maps),
      messages_(config.lcm, sensor, config.method.odometry.motion, config.extrinsics.T_base_sensor(), kPatience,
                nullptr),
      board_(DLOD_VERSION, sensor.description(), monotonic_ns()) {}

void ReplayMessages::add(const PipelineFrame& frame) {
    board_.add(frame, monotonic_ns());
}

void ReplayMessages::listen(Pipeline& pipeline) {
    control_ = RemoteControl::listen(config_, pipeline_actions(maps_, pipeline), board_, messages_.bus());
}

void ReplayMessages::report_if_due(const Pipeline& pipeline, const driver::PacketSource& source) {
    if (monotonic_ns() - reported_ns_ >= kReportPeriod_ns) report(pipeline, source);
}

void ReplayMessages::report(const Pipeline& pipeline, const driver::PacketSource& source) {
    reported_ns_ = monotonic_ns();
    CounterList counters;
    const driver::CounterVisitor collect = [&](std::string_view name, std::uint64_t value) {
        counters.emplace_back(name, value);
    };
    source.visit_counters(collect);
    pipeline.ingest().counters().visit(collect);
    collect("lcm_failed", messages_.failed());
    if (control_) control_->visit_counters(collect);
    const std::int64_t utime = StepTimer::now_ns(CLOCK_REALTIME) / 1000;
    messages_.announce_sensor(reported_ns_, utime);
    messages_.send(board_.compose(counters, pipeline.ingest().last_packet_ns(), reported_ns_, utime));
}

}  // namespace dlod::daemon
