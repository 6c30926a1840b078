#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/control/remote_control.hpp"
#include "daemon/publish/message_bus.hpp"
#include "daemon/publish/message_sender.hpp"
#include "daemon/status/status_board.hpp"

namespace dlod::daemon {

/// The status of a service that has no sensor yet: planners and lcm-spy see that it lives and what it waits for, and
/// commands are answered.
class WaitingStatus {
  public:
    /// @param start_ns CLOCK_MONOTONIC of the service's start
    WaitingStatus(const Config& config, std::int64_t start_ns);

    /// Once a second. @param trouble with the sensor; empty: none known
    void report(const std::string& trouble);
    std::string one_line() const { return board_.one_line(); }

  private:
    void open_bus();

    LcmConfig config_;
    std::unique_ptr<MessageBus> bus_;
    std::unique_ptr<MessageSender> sender_;
    StatusBoard board_;
    std::unique_ptr<RemoteControl> control_;  // last: its thread uses all of the above
};

}  // namespace dlod::daemon
