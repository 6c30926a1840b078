#include "daemon/commands/live_service.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <utility>

#include "daemon/commands/load_config.hpp"
#include "daemon/commands/reload.hpp"
#include "daemon/config/option.hpp"
#include "daemon/pipeline/stage_times.hpp"

namespace dlod::daemon {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr auto kReportPeriod = std::chrono::seconds(1);
/// Between attempts to open LCM and the sockets.
constexpr auto kAttemptPeriod = std::chrono::seconds(2);
/// How long new metadata may wait to be looked for.
constexpr milliseconds kLookPeriod{100};

/// systemd names the directory; by hand, nothing is kept.
std::string state_directory() {
    const char* directory = std::getenv("STATE_DIRECTORY");
    return directory == nullptr ? "" : directory;
}

}  // namespace

LiveService::LiveService(const ConfigSources& sources) : sources_(sources), config_(load_config(sources, nullptr)) {
    // A sensor that hangs up in mid-request, or who read the log and has gone, is an error of the write, not the end.
    std::signal(SIGPIPE, SIG_IGN);
    set_up_log(config_.log.level);
    start_.start_ns = StepTimer::now_ns(CLOCK_MONOTONIC);
    start_.is_service = service_.is_service();
    const auto metadata = configured_metadata(config_.sensor);
    watch_ = std::make_unique<SensorWatch>(config_.sensor, metadata, state_directory());
}

LiveService::~LiveService() = default;

void LiveService::run() {
    // A sensor that is still booting is awaited: that is no failure of the service.
    if (config_.sensor.metadata.empty()) service_.ready("waiting for sensor " + config_.sensor.host);
    auto next_report = Clock::now() + kReportPeriod;
    while (!stopping_ || session_) {
        begin_session_if_asked();
        const auto left = std::chrono::duration_cast<milliseconds>(next_report - Clock::now());
        handle(
            signals_.wait(session_ ? session_->done_descriptor() : -1, std::clamp(left, milliseconds(0), kLookPeriod)));
        if (session_ && session_->done()) end_session();
        const bool at_the_end = stopping_ && !session_;
        if (at_the_end || Clock::now() < next_report) continue;
        // After a standstill (SIGSTOP, say) what was missed is not made up for.
        next_report = std::max(next_report + kReportPeriod, Clock::now());
        report();
    }
}

void LiveService::handle(SignalWaiter::Event event) {
    if (event == SignalWaiter::Event::kStop && !std::exchange(stopping_, true)) {
        service_.stopping();
        if (session_) session_->stop();
    }
    if (event == SignalWaiter::Event::kReload) reload_config();
}

void LiveService::reload_config() {
    service_.reloading();
    const Reload result = reload(sources_, sensor_ ? &*sensor_ : nullptr, config_);
    if (!result.error.empty()) {
        spdlog::error("reload: {}; the running configuration stays in force", result.error);
    } else {
        set_up_log(config_.log.level);
        for (const auto& option : result.changed) spdlog::info("reload: now {}", option);
        for (const auto& option : result.at_restart) spdlog::warn("reload: at the next restart {}", option);
        if (result.changed.empty() && result.at_restart.empty()) spdlog::info("reload: nothing has changed");
        if (!result.changed.empty()) {
            watch_->configure(config_.sensor);
            if (session_) session_->configure(config_);
        }
    }
    service_.ready(session_ ? session_->one_line() : waiting_ ? waiting_->one_line() : "waiting for the sensor");
}

/// The session at work, if any, comes to its end first: what it has received is not lost, and its ports become free.
void LiveService::begin_session_if_asked() {
    if (auto metadata = watch_->take_metadata()) {
        next_metadata_ = std::move(metadata);
        session_trouble_.clear();
        if (session_) session_->stop();
    }
    if (!next_metadata_ || session_ || stopping_ || Clock::now() < next_attempt_) return;
    sensor_ = driver::parse_metadata(next_metadata_->json, next_metadata_->name);
    if (session_trouble_.empty()) {  // not with every attempt
        for (const auto& warning : sensor_->warnings) spdlog::warn("{}", warning);
    }
    load_config_for_session();
    try {
        session_ = std::make_unique<LiveSession>(config_, *sensor_, next_metadata_->json, start_);
    } catch (const MessageBusError& error) {
        postpone_session(error.what());
        return;
    } catch (const driver::SourceError& error) {
        postpone_session(error.what());
        return;
    }
    session_trouble_.clear();
    next_metadata_.reset();
    waiting_.reset();
    session_->start();
}

/// With the preset of its sensor.
void LiveService::load_config_for_session() {
    try {
        config_ = load_config(sources_, &*sensor_);
        config_trouble_.clear();
    } catch (const ConfigError& error) {
        if (std::exchange(config_trouble_, error.what()) == error.what()) return;
        spdlog::error("{}; the running configuration stays in force", error.what());
    }
}

/// In a handler. The network or the sensor's interface may come up later than the service, and another program may give
/// up its port. By hand, that ends the program.
void LiveService::postpone_session(const std::string& trouble) {
    if (!start_.is_service && start_.sessions_before == 0) throw;
    session_trouble_ = trouble;
    service_.ready(session_trouble_);
    next_attempt_ = Clock::now() + kAttemptPeriod;
}

void LiveService::end_session() {
    session_->finish();
    start_ = session_->next_start();
    session_.reset();
    // Without the sensor's being another one, only a stop ends a session.
    if (!next_metadata_) stopping_ = true;
}

void LiveService::report() {
    const std::string trouble = session_trouble_.empty() ? watch_->trouble() : session_trouble_;
    if (trouble != trouble_ && !trouble.empty()) warnings_.warn(trouble, trouble);
    trouble_ = trouble;
    if (session_) {
        session_->report(trouble);
        watch_->observe(session_->stream());
        return;
    }
    if (!waiting_) waiting_ = std::make_unique<WaitingStatus>(config_, start_.start_ns);
    waiting_->report(trouble);
    service_.status(waiting_->one_line());
    service_.watchdog();
}

}  // namespace dlod::daemon
