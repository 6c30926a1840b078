#include "daemon/control/remote_control.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "daemon/pipeline/stage_times.hpp"

namespace dlod::daemon {
namespace {

const char* in_words(const command_t& command) {
    switch (command.command) {
        case command_t::SAVE_MAP:
            return "save map";
        case command_t::RESTART_ODOMETRY:
            return "restart odometry";
        case command_t::SET_LOG_LEVEL:
            return "set log level";
        default:
            return "unknown";
    }
}

}  // namespace

std::unique_ptr<RemoteControl> RemoteControl::listen(const LcmConfig& config, CommandActions actions,
                                                     StatusBoard& board, MessageBus& bus) {
    if (!config.commands || !CommandListener::can_listen(config.url)) return nullptr;
    return std::make_unique<RemoteControl>(config, std::move(actions), board, bus);
}

RemoteControl::RemoteControl(const LcmConfig& config, CommandActions actions, StatusBoard& board, MessageBus& bus)
    : board_(board),
      sender_(bus),
      status_channel_(config.channel_prefix + "STATUS"),
      handler_(std::move(actions),
               [this](const command_t& command, const CommandAnswer& result) { answer(command, result); }),
      listener_(config.url, config.channel_prefix + "COMMAND",
                [this](std::span<const std::byte> message) { handler_.receive(message); }) {}

void RemoteControl::answer(const command_t& command, const CommandAnswer& answer) {
    const std::int64_t utime = StepTimer::now_ns(CLOCK_REALTIME) / 1000;
    spdlog::log(answer.ok ? spdlog::level::info : spdlog::level::warn, "command {}, {}: {}", answer.id,
                in_words(command), answer.text);
    sender_.send(status_channel_, board_.answer(answer, utime));
}

}  // namespace dlod::daemon
