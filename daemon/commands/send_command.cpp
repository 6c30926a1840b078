#include <chrono>
#include <cstdio>
#include <dlod/command_t.hpp>
#include <dlod/status_t.hpp>
#include <lcm/lcm-cpp.hpp>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/config/option.hpp"
#include "daemon/pipeline/stage_times.hpp"
#include "daemon/publish/lcm_bus.hpp"

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

}  // namespace

ExitCode send_command(const SendArguments& arguments) {
    const Config config = load_config(arguments.config, nullptr);
    if (config.lcm.url == "none") throw ConfigError("lcm.url: none; commands need one, that of the dlod that runs");
    require_route(config.lcm.url);
    lcm::LCM lcm(config.lcm.url);
    if (!lcm.good()) throw MessageBusError("LCM cannot be opened: see dlod doctor");
    command_t command{};
    command.utime = StepTimer::now_ns(CLOCK_REALTIME) / 1000;
    command.id = command.utime;
    command.command = static_cast<std::int8_t>(arguments.command);
    command.argument = arguments.argument;
    AnswerWaiter waiter(command.id);
    lcm.subscribe(config.lcm.channel_prefix + "STATUS", &AnswerWaiter::on_status, &waiter);
    const auto deadline =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(arguments.timeout_s));
    auto next_send = Clock::now();
    while (!waiter.answered() && Clock::now() < deadline) {
        if (Clock::now() >= next_send) {
            lcm.publish(config.lcm.channel_prefix + "COMMAND", &command);
            next_send += kResend;
        }
        if (lcm.handleTimeout(100) < 0) throw MessageBusError("LCM cannot receive: see dlod doctor");
    }
    if (!waiter.answered()) {
        throw MessageBusError("no answer on " + config.lcm.channel_prefix +
                              "STATUS: does dlod run, with the same lcm.url and lcm.channel_prefix, and with "
                              "lcm.commands on?");
    }
    std::printf("%s\n", waiter.answer().command_answer.c_str());
    return waiter.answer().command_ok != 0 ? ExitCode::kSuccess : ExitCode::kFailure;
}

}  // namespace dlod::daemon
