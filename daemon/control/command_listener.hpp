// The way in for commands: LCM's receiving side, on a thread of its own.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace dlod::daemon {

/// Opening LCM's receiving side can take ten seconds where multicast does not work: nobody but this thread waits for
/// it. Where it cannot be opened, or fails later, that is logged, and tried again every ten seconds.
class CommandListener {
  public:
    /// @param url LCM provider; empty: LCM's default
    /// @param receive takes the content of each message on the channel, on the listener's thread
    CommandListener(const std::string& url, const std::string& channel,
                    std::function<void(std::span<const std::byte>)> receive);
    /// `receive` is not called any more afterwards; waits for a call that is under way.
    ~CommandListener();
    CommandListener(const CommandListener&) = delete;
    CommandListener& operator=(const CommandListener&) = delete;

    /// False where listening would do harm or nothing: a log file as provider, or none.
    static bool can_listen(const std::string& url);

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with the thread, which is left behind while LCM does not let go of it
};

}  // namespace dlod::daemon
