#include "daemon/control/command_handler.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/control/command_decoder.hpp"

namespace dlod::daemon {

void CommandHandler::receive(std::span<const std::byte> message) {
    const auto command = decode_command(message);
    if (!command) {
        ++ignored_;
        return;
    }
    const auto is_again = [&](const Done& done) { return done.id == command->id && done.utime == command->utime; };
    auto done = std::find_if(done_.begin(), done_.end(), is_again);
    if (done == done_.end()) {
        ++commands_;
        done = done_.begin() + static_cast<std::ptrdiff_t>(next_++ % done_.size());
        *done = {command->id, command->utime, carry_out(*command)};
        done->answer.id = command->id;
    }
    answer_(*command, done->answer);
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
