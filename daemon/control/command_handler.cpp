#include "daemon/control/command_handler.hpp"

#include <fmt/format.h>

#include "daemon/control/command_decoder.hpp"

namespace dlod::daemon {

void CommandHandler::receive(std::span<const std::byte> message) {
    const auto command = decode_command(message);
    if (!command) {
        ++ignored_;
        return;
    }
    const bool again = last_ && last_->id == command->id && last_->utime == command->utime;
    if (!again) {
        ++commands_;
        last_answer_ = carry_out(*command);
        last_answer_.id = command->id;
        last_ = command;
    }
    answer_(*command, last_answer_);
}

CommandAnswer CommandHandler::carry_out(const command_t& command) {
    switch (command.command) {
        case command_t::SAVE_MAP:
            return actions_.save_map(command.argument);
        case command_t::RESTART_ODOMETRY:
            return actions_.restart_odometry();
        case command_t::SET_LOG_LEVEL:
            return actions_.set_log_level(command.argument);
        default:
            return {0, false, fmt::format("there is no command {}", command.command)};
    }
}

}  // namespace dlod::daemon
