// Datagrams from their IP fragments, with no way for two datagrams to mix.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "driver/counter.hpp"
#include "driver/ip_packet.hpp"

namespace dlod::driver {

/// Bounds of what waits for its missing fragments.
struct ReassemblyLimits {
    int datagrams = 64;                        ///< at once, each of at most 64 KiB; the oldest gives way
    int fragments = 512;                       ///< of one datagram
    std::int64_t timeout_ns = 1'000'000'000;   ///< in capture time, from a datagram's first fragment. A sensor sends
                                               ///< one within milliseconds and uses an id again after a minute or so.
    std::uint64_t timeout_fragments = 30'000;  ///< the same where the capture's times are wrong: a sender needs more
                                               ///< than this before its 16-bit ids come round
};

/// What became of fragments and datagrams.
struct ReassemblyCounters {
    Counter fragments;            ///< fragments seen
    Counter reassembled;          ///< datagrams completed
    Counter duplicate_fragments;  ///< the same bytes again: ignored
    Counter overlapping;          ///< datagrams dropped: fragments contradicted each other (an id used again, say)
    Counter rejected_fragments;   ///< further fragments of such datagrams
    Counter timed_out;            ///< datagrams whose fragments did not all come in time
    Counter evicted;              ///< datagrams given up because too many waited, or of too many fragments
    Counter malformed;            ///< fragments with an impossible offset or length
};

/// Puts IPv4 and IPv6 fragments together again. Fragments belong together when source, destination, protocol, id and
/// VLAN agree. A fragment that overlaps another, or contradicts the datagram's length, condemns the whole datagram
/// (RFC 5722, applied to IPv4 too); a fragment that repeats an earlier one byte by byte is ignored, also for a while
/// after the datagram is complete. After a contradiction the id is good again from the next first fragment on, but
/// until the timeout only for fragments in order and without a gap. Two datagrams of the same id, each with fragments
/// missing, can still fit like one: the caller verifies UDP's length and checksum. Deterministic; allocates only while
/// it warms up.
class IpReassembly {
  public:
    explicit IpReassembly(const ReassemblyLimits& limits = {});
    ~IpReassembly();

    /// Takes a fragment captured at `time_ns`. Returns the whole datagram's payload if this one completes it, else
    /// nothing. The bytes are valid until the next call.
    Bytes add(const IpPacket& fragment, std::uint32_t vlan, std::int64_t time_ns);

    /// Of the datagram that add() returned last: another one had its id shortly before. Only with a right checksum is
    /// it certain that nothing of the other is in it.
    bool contested() const;

    /// The datagram that add() returned just now is none: what comes under its id belongs to others.
    void refuse(std::int64_t time_ns);

    /// At the capture's end: counts whatever is incomplete as timed out.
    void finish();

    const ReassemblyCounters& counters() const { return counters_; }
    void visit_counters(const CounterVisitor& visit) const;

  private:
    struct Slot;

    bool expired(const Slot& slot, std::int64_t time_ns) const;
    void give_up(Slot& slot, Counter& reason);
    void begin(Slot& slot, std::int64_t time_ns);
    void condemn(Slot& slot, std::int64_t time_ns);
    void expire(std::int64_t time_ns);
    Slot& take_slot();

    ReassemblyLimits limits_;
    std::vector<std::unique_ptr<Slot>> slots_;
    std::int64_t next_sweep_ns_ = 0;
    Slot* recent_ = nullptr;     ///< of the last fragment: the next one is mostly of the same datagram
    Slot* delivered_ = nullptr;  ///< by the call of add() before
    ReassemblyCounters counters_;
};

}  // namespace dlod::driver
