#include "daemon/service/log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace dlod::daemon {

void set_up_log(int level) {
    auto logger = spdlog::get("dlod");
    if (!logger) {
        logger = spdlog::stderr_color_mt("dlod");
        logger->set_pattern("%^%l%$: %v");
        spdlog::set_default_logger(logger);
    }
    spdlog::set_level(static_cast<spdlog::level::level_enum>(level));
}

bool RepeatedWarnings::warn(const std::string& kind, const std::string& message, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    const bool too_many = kinds_.size() >= kMostKinds && !kinds_.contains(kind);
    const auto [entry, first] = kinds_.try_emplace(too_many ? "any other" : kind);
    auto& state = entry->second;
    if (!first && now - state.written < interval_) {
        ++state.held_back;
        return false;
    }
    if (state.held_back > 0) {
        spdlog::warn("{} ({} more like this since the last time)", message, state.held_back);
    } else {
        spdlog::warn("{}", message);
    }
    state = {now, 0};
    return true;
}

}  // namespace dlod::daemon
