#include "daemon/commands/waiting_status.hpp"

#include "daemon/pipeline/stage_times.hpp"

namespace dlod::daemon {

WaitingStatus::WaitingStatus(const Config& config, std::int64_t start_ns)
    : channel_(config.lcm.channel_prefix + "STATUS"),
      bus_(config.lcm.url == "none" ? nullptr : std::make_unique<LcmBus>(config.lcm.url)),
      sender_(bus_ ? std::make_unique<MessageSender>(*bus_) : nullptr),
      board_(DLOD_VERSION, "none yet", start_ns) {}

void WaitingStatus::report(const std::string& trouble) {
    board_.set_sensor_trouble(trouble);
    const auto& status =
        board_.compose({}, 0, StepTimer::now_ns(CLOCK_MONOTONIC), StepTimer::now_ns(CLOCK_REALTIME) / 1000);
    if (sender_) sender_->send(channel_, status);
}

}  // namespace dlod::daemon
