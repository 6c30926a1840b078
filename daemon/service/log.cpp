#include "daemon/service/log.hpp"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace dlod::daemon {
namespace {

/// True where stderr is the journal, as systemd tells those that it starts.
bool writes_to_journal() {
    const char* journal = std::getenv("JOURNAL_STREAM");
    struct stat file {};
    return journal != nullptr && ::fstat(STDERR_FILENO, &file) == 0 &&
           fmt::format("{}:{}", file.st_dev, file.st_ino) == journal;
}

/// What the journal takes a line's priority from: `journalctl -p warning` finds warnings.
class JournalPriority : public spdlog::custom_flag_formatter {
  public:
    void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
        constexpr std::string_view kPriorities[] = {"<7>", "<7>", "<6>", "<4>", "<3>", "<2>", "<7>"};
        out.append(kPriorities[message.level]);
    }
    std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JournalPriority>(); }
};

std::unique_ptr<spdlog::formatter> make_formatter() {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    const bool journal = writes_to_journal();
    formatter->add_flag<JournalPriority>('J').set_pattern(journal ? "%J%l: %v" : "%^%l%$: %v");
    return formatter;
}

}  // namespace

void set_up_log(int level) {
    auto logger = spdlog::get("dlod");
    if (!logger) {
        logger = spdlog::stderr_color_mt("dlod");
        logger->set_formatter(make_formatter());
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
