#include "daemon/control/remote_control.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <string_view>
#include <thread>

#include "daemon/service/log.hpp"

namespace dlod::daemon {
namespace {

/// A restart takes effect with the next frame; where none comes for so long, none is coming.
constexpr auto kRestartPatience = std::chrono::seconds(1);
constexpr auto kRestartPoll = std::chrono::milliseconds(5);

std::string in_words(const command_t& command) {
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

CommandAnswer set_log_level(const std::string& name) {
    constexpr std::string_view kLevels[] = {"trace", "debug", "info", "warning", "error", "off"};
    const auto* const found = std::find(std::begin(kLevels), std::end(kLevels), name);
    if (found == std::end(kLevels)) {
        return {0, false, fmt::format("no such level; valid: {}", fmt::join(kLevels, ", "))};
    }
    set_up_log(static_cast<int>(found - std::begin(kLevels)));
    return {0, true, fmt::format("log.level is now {}", name)};
}

}  // namespace

RemoteControl::RemoteControl(const LcmConfig& config, const MapStore& maps, Pipeline& pipeline, StatusBoard& board,
                             MessageBus& bus)
    : maps_(maps),
      pipeline_(pipeline),
      board_(board),
      sender_(bus),
      status_channel_(config.channel_prefix + "STATUS"),
      handler_(actions(), [this](const command_t& command, const CommandAnswer& result) { answer(command, result); }),
      listener_(config.url, config.channel_prefix + "COMMAND",
                [this](std::span<const std::byte> message) { handler_.receive(message); }) {}

CommandActions RemoteControl::actions() {
    return {.save_map = [this](const std::string& name) { return save_map(name); },
            .restart_odometry = [this] { return restart_odometry(); },
            .set_log_level = set_log_level};
}

CommandAnswer RemoteControl::save_map(const std::string& name) {
    auto result = maps_.save(name, pipeline_.map_snapshot());
    return {0, result.ok, std::move(result.text)};
}

CommandAnswer RemoteControl::restart_odometry() {
    const std::uint64_t before = pipeline_.restarts();
    pipeline_.request_restart();
    const auto deadline = std::chrono::steady_clock::now() + kRestartPatience;
    while (pipeline_.restarts() == before) {
        if (std::chrono::steady_clock::now() > deadline)
            return {0, true, "no frames come: the odometry begins anew with the next one"};
        std::this_thread::sleep_for(kRestartPoll);
    }
    return {0, true, "the odometry has begun anew"};
}

void RemoteControl::answer(const command_t& command, const CommandAnswer& answer) {
    const std::int64_t utime = StepTimer::now_ns(CLOCK_REALTIME) / 1000;
    spdlog::log(answer.ok ? spdlog::level::info : spdlog::level::warn, "command {}, {}: {}", answer.id,
                in_words(command), answer.text);
    sender_.send(status_channel_, board_.answer(answer, utime));
}

}  // namespace dlod::daemon
