// Commands that come over LCM while a session runs.
#pragma once

#include "daemon/control/command_handler.hpp"
#include "daemon/control/command_listener.hpp"
#include "daemon/output/map_store.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/publish/message_config.hpp"
#include "daemon/publish/message_sender.hpp"
#include "daemon/status/status_board.hpp"

namespace dlod::daemon {

/// Listens on a thread of its own, on which commands are carried out one after the other; saving a map takes none of
/// the pipeline's time but a copy. Destroy it before what it was given.
class RemoteControl {
  public:
    RemoteControl(const LcmConfig& config, const MapStore& maps, Pipeline& pipeline, StatusBoard& board,
                  MessageBus& bus);

    /// From any thread.
    void visit_counters(const driver::CounterVisitor& visit) const { handler_.visit_counters(visit); }

  private:
    CommandActions actions();
    CommandAnswer save_map(const std::string& name);
    CommandAnswer restart_odometry();
    void answer(const command_t& command, const CommandAnswer& answer);

    const MapStore& maps_;
    Pipeline& pipeline_;
    StatusBoard& board_;
    MessageSender sender_;
    std::string status_channel_;
    CommandHandler handler_;
    CommandListener listener_;  // last: its thread uses all of the above
};

}  // namespace dlod::daemon
