// Where packets come from: a socket or a capture, behind one interface.
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "driver/counter.hpp"
#include "driver/packet.hpp"

namespace dlod::driver {

/// A source that cannot be opened. The message names the file, or the option, address and port, and what to do.
class SourceError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

enum class SourceStatus {
    kPackets,  ///< the batch has packets
    kIdle,     ///< nothing came within the source's timeout; ask again
    kEnd,      ///< the capture is at its end
    kStopped,  ///< stop() was called
};

/// What one call yields. The packets and their bytes live until the next call.
struct PacketBatch {
    SourceStatus status = SourceStatus::kIdle;
    std::span<const Packet> packets;  ///< in order of receipt; empty unless kPackets
};

/// Yields UDP datagrams in batches. One thread calls next(); stop() and the counters may be used from any thread.
class PacketSource {
  public:
    virtual ~PacketSource() = default;

    /// The next packets; waits for at most the source's timeout. Never throws: faults are counted or become warnings.
    virtual PacketBatch next() = 0;

    /// Makes the current and every later next() return kStopped at once. Safe in a signal handler.
    virtual void stop() noexcept = 0;

    /// Calls `visit` with every counter, faults and successes alike, in a fixed order.
    virtual void visit_counters(const CounterVisitor& visit) const = 0;

    /// Messages for the operator since the last call, each one said once. For the thread that calls next().
    std::vector<std::string> take_warnings() { return std::exchange(warnings_, {}); }

  protected:
    PacketSource() = default;
    PacketSource(const PacketSource&) = delete;
    PacketSource& operator=(const PacketSource&) = delete;

    void warn(std::string message) { warnings_.push_back(std::move(message)); }

  private:
    std::vector<std::string> warnings_;
};

}  // namespace dlod::driver
