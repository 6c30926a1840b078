#include "daemon/commands/waiting_status.hpp"

#include <spdlog/spdlog.h>

#include "daemon/pipeline/stage_times.hpp"

namespace dlod::daemon {

WaitingStatus::WaitingStatus(const Config& config, std::int64_t start_ns)
    : url_(config.lcm.url),
      channel_(config.lcm.channel_prefix + "STATUS"),
      board_(DLOD_VERSION, "none yet", start_ns) {}

/// The network may not be up yet: systemd's status line works without.
void WaitingStatus::open_bus() {
    if (bus_ || url_ == "none") return;
    try {
        bus_ = std::make_unique<LcmBus>(url_);
        sender_ = std::make_unique<MessageSender>(*bus_);
    } catch (const MessageBusError& error) {
        spdlog::debug("{}", error.what());
    }
}

void WaitingStatus::report(const std::string& trouble) {
    open_bus();
    board_.set_sensor_trouble(trouble);
    const auto& status =
        board_.compose({}, 0, StepTimer::now_ns(CLOCK_MONOTONIC), StepTimer::now_ns(CLOCK_REALTIME) / 1000);
    if (sender_) sender_->send(channel_, status);
}

}  // namespace dlod::daemon
