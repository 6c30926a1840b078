#include <chrono>
#include <cstdio>
#include <dlod/command_t.hpp>
#include <dlod/status_t.hpp>
#include <future>
#include <lcm/lcm-cpp.hpp>
#include <thread>
#include <utility>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/config/option.hpp"
#include "daemon/pipeline/stage_times.hpp"
#include "daemon/publish/lcm_bus.hpp"
#include "daemon/publish/lcm_url.hpp"

namespace dlod::daemon {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// A message can be lost: it goes out again until it is answered. dlod carries it out once all the same.
constexpr milliseconds kResend{1000};

/// Waits for the status that answers a command.
class AnswerWaiter {
  public:
    explicit AnswerWaiter(std::int64_t id) : id_(id) {}
    void on_status(const lcm::ReceiveBuffer*, const std::string&, const status_t* status) {
        if (status->command_id == id_ && !answered_) {
            answered_ = true;
            answer_ = *status;
        }
    }
    bool answered() const { return answered_; }
    const status_t& answer() const { return answer_; }

  private:
    std::int64_t id_;
    bool answered_ = false;
    status_t answer_{};
};

/// Sends the command until it is answered.
status_t exchange(const LcmConfig& config, const command_t& command, std::chrono::duration<double> timeout) {
    lcm::LCM lcm(config.url);
    if (!lcm.good()) throw MessageBusError("LCM cannot be opened: see dlod doctor");
    AnswerWaiter waiter(command.id);
    lcm.subscribe(config.channel_prefix + "STATUS", &AnswerWaiter::on_status, &waiter);
    const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(timeout);
    auto next_send = Clock::now();
    while (!waiter.answered() && Clock::now() < deadline) {
        if (Clock::now() >= next_send) {
            lcm.publish(config.channel_prefix + "COMMAND", &command);
            next_send += kResend;
        }
        if (lcm.handleTimeout(100) < 0) throw MessageBusError("LCM cannot receive: see dlod doctor");
    }
    if (!waiter.answered()) {
        throw MessageBusError("no answer on " + config.channel_prefix +
                              "STATUS: does dlod run, with the same lcm.url and lcm.channel_prefix, and with "
                              "lcm.commands on?");
    }
    return waiter.answer();
}

/// The same where LCM itself can be blocked: it is left to itself then.
status_t exchange_or_give_up(const LcmConfig& config, const command_t& command, std::chrono::duration<double> timeout) {
    std::packaged_task<status_t()> task([=] { return exchange(config, command, timeout); });
    auto answer = task.get_future();
    std::thread(std::move(task)).detach();
    if (answer.wait_for(timeout + kResend) != std::future_status::ready) {
        throw MessageBusError("lcm.url '" + url_or_default(config.url) + "': its server does not answer");
    }
    return answer.get();
}

}  // namespace

ExitCode send_command(const SendArguments& arguments) {
    const Config config = load_config(arguments.config, nullptr);
    if (config.lcm.url == "none") throw ConfigError("lcm.url: none; commands need one, that of the dlod that runs");
    require_route(config.lcm.url);
    command_t command{};
    command.utime = StepTimer::now_ns(CLOCK_REALTIME) / 1000;
    command.id = command.utime;
    command.command = static_cast<std::int8_t>(arguments.command);
    command.argument = arguments.argument;
    const std::chrono::duration<double> timeout(arguments.timeout_s);
    const status_t answer = can_be_blocked(config.lcm.url) ? exchange_or_give_up(config.lcm, command, timeout)
                                                           : exchange(config.lcm, command, timeout);
    std::printf("%s\n", answer.command_answer.c_str());
    return answer.command_ok != 0 ? ExitCode::kSuccess : ExitCode::kFailure;
}

}  // namespace dlod::daemon
