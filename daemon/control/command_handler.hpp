// Commands, from the bytes of a message to the answer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dlod/command_t.hpp>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "driver/counter.hpp"

namespace dlod::daemon {

/// What became of a command; goes out with status_t.
struct CommandAnswer {
    std::int64_t id = 0;
    bool ok = false;
    std::string text;
};

/// What commands do. Each returns what it came to; `id` is filled in by the handler.
struct CommandActions {
    std::function<CommandAnswer(const std::string& name)> save_map;
    std::function<CommandAnswer()> restart_odometry;
    std::function<CommandAnswer(const std::string& level)> set_log_level;
};

/// For one thread, but for the counters.
class CommandHandler {
  public:
    /// @param answer takes each answer
    CommandHandler(CommandActions actions, std::function<void(const command_t&, const CommandAnswer&)> answer)
        : actions_(std::move(actions)), answer_(std::move(answer)) {}

    /// Carries out the command in the message and answers it. What is no command is ignored and counted; a command
    /// that was among the last ones already is only answered again: senders repeat theirs until they are answered, and
    /// those of several arrive in between.
    void receive(std::span<const std::byte> message);

    void visit_counters(const driver::CounterVisitor& visit) const {
        visit("commands", commands_.value());
        visit("commands_ignored", ignored_.value());
    }

  private:
    /// A command that was carried out; none yet where it has no id.
    struct Done {
        std::optional<std::int64_t> id;
        std::int64_t utime = 0;
        CommandAnswer answer;
    };

    CommandAnswer carry_out(const command_t& command);

    CommandActions actions_;
    std::function<void(const command_t&, const CommandAnswer&)> answer_;
    std::array<Done, 32> done_;  ///< the last ones
    std::size_t next_ = 0;       ///< modulo their number: the place of the next one
    driver::Counter commands_;
    driver::Counter ignored_;  ///< messages that were no commands
};

}  // namespace dlod::daemon
