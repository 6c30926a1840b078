// Commands that come over LCM, and their answers.
#pragma once

#include <memory>

#include "daemon/control/command_handler.hpp"
#include "daemon/control/command_listener.hpp"
#include "daemon/publish/message_config.hpp"
#include "daemon/publish/message_sender.hpp"
#include "daemon/status/status_board.hpp"

namespace dlod::daemon {

/// Listens on a thread of its own, on which commands are carried out one after the other. Destroy it before what it was
/// given.
class RemoteControl {
  public:
    /// Listens from now on. @return nothing where the configuration wants no commands, or where none can come
    static std::unique_ptr<RemoteControl> listen(const LcmConfig& config, CommandActions actions, StatusBoard& board,
                                                 MessageBus& bus);

    RemoteControl(const LcmConfig& config, CommandActions actions, StatusBoard& board, MessageBus& bus);

    /// From any thread.
    void visit_counters(const driver::CounterVisitor& visit) const { handler_.visit_counters(visit); }

  private:
    void answer(const command_t& command, const CommandAnswer& answer);

    StatusBoard& board_;
    MessageSender sender_;
    std::string status_channel_;
    CommandHandler handler_;
    CommandListener listener_;  // last: its thread uses all of the above
};

}  // namespace dlod::daemon
