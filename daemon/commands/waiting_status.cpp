#include "daemon/commands/waiting_status.hpp"

#include <spdlog/spdlog.h>

#include <chrono>

#include "daemon/control/command_actions.hpp"
#include "daemon/pipeline/stage_times.hpp"
#include "daemon/publish/lcm_bus.hpp"

namespace dlod::daemon {

WaitingStatus::WaitingStatus(const Config& config, std::int64_t start_ns)
    : config_(config.lcm), board_(DLOD_VERSION, "none yet", start_ns) {}

/// The network may not be up yet: systemd's status line works without.
void WaitingStatus::open_bus() {
    if (bus_ || config_.url == "none") return;
    try {
        bus_ = open_lcm(config_.url, std::chrono::milliseconds(0));
        sender_ = std::make_unique<MessageSender>(*bus_);
        control_ = RemoteControl::listen(config_, waiting_actions(), board_, *bus_);
    } catch (const MessageBusError& error) {
        spdlog::debug("{}", error.what());
    }
}

void WaitingStatus::report(const std::string& trouble) {
    open_bus();
    board_.set_sensor_trouble(trouble);
    CounterList counters;
    if (control_) {
        control_->visit_counters(
            [&](std::string_view name, std::uint64_t value) { counters.emplace_back(name, value); });
    }
    const auto& status =
        board_.compose(counters, 0, StepTimer::now_ns(CLOCK_MONOTONIC), StepTimer::now_ns(CLOCK_REALTIME) / 1000);
    if (sender_) sender_->send(config_.channel_prefix + "STATUS", status);
}

}  // namespace dlod::daemon
