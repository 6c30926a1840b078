#include "daemon/control/command_actions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <string_view>
#include <thread>
#include <utility>

#include "daemon/service/log.hpp"

namespace dlod::daemon {
namespace {

/// A restart takes effect with the next frame; where none comes for so long, none is coming.
constexpr auto kRestartPatience = std::chrono::seconds(1);
constexpr auto kRestartPoll = std::chrono::milliseconds(5);

CommandAnswer set_log_level(const std::string& name) {
    constexpr std::string_view kLevels[] = {"trace", "debug", "info", "warning", "error", "off"};
    const auto* const found = std::find(std::begin(kLevels), std::end(kLevels), name);
    if (found == std::end(kLevels)) {
        return {0, false, fmt::format("no such level; valid: {}", fmt::join(kLevels, ", "))};
    }
    set_up_log(static_cast<int>(found - std::begin(kLevels)));
    return {0, true, fmt::format("log.level is now {}", name)};
}

CommandAnswer restart_odometry(Pipeline& pipeline) {
    const std::uint64_t before = pipeline.restarts();
    pipeline.request_restart();
    const auto deadline = std::chrono::steady_clock::now() + kRestartPatience;
    while (pipeline.restarts() == before) {
        if (std::chrono::steady_clock::now() > deadline)
            return {0, true, "no frames come: the odometry begins anew with the next one"};
        std::this_thread::sleep_for(kRestartPoll);
    }
    return {0, true, "the odometry has begun anew"};
}

}  // namespace

CommandActions pipeline_actions(const MapStore& maps, Pipeline& pipeline) {
    return {.save_map =
                [&maps, &pipeline](const std::string& name) {
                    auto result = maps.save(name, pipeline.map_snapshot());
                    return CommandAnswer{0, result.ok, std::move(result.text)};
                },
            .restart_odometry = [&pipeline] { return restart_odometry(pipeline); },
            .set_log_level = set_log_level};
}

CommandActions waiting_actions() {
    return {
        .save_map =
            [](const std::string&) {
                return CommandAnswer{0, false, "there is no map: the service still waits for its sensor"};
            },
        .restart_odometry =
            [] {
                return CommandAnswer{0, true, "the service still waits for its sensor: the odometry begins with it"};
            },
        .set_log_level = set_log_level};
}

}  // namespace dlod::daemon
