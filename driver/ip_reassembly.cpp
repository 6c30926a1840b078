#include "driver/ip_reassembly.hpp"

#include <algorithm>
#include <cstring>

namespace dlod::driver {
namespace {

constexpr std::size_t kLargestDatagram = 65535;

struct Key {
    std::uint32_t id = 0;  // first, since it tells most datagrams apart
    IpAddress source{};
    IpAddress destination{};
    std::uint32_t vlan = 0;
    std::uint8_t protocol = 0;

    bool operator==(const Key&) const = default;
};

/// Bytes [begin, end) of a datagram that one fragment brought.
struct Piece {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
};

enum class State {
    kFree,
    kWaiting,    ///< for fragments
    kComplete,   ///< delivered; kept to tell late duplicates from a new datagram with the same id
    kCondemned,  ///< contradicted itself; what comes under its id is rejected up to the next first fragment
};

}  // namespace

struct IpReassembly::Slot {
    State state = State::kFree;
    Key key;
    std::int64_t first_ns = 0;
    std::uint64_t first_fragment = 0;  ///< running number, the order of age
    std::uint32_t length = 0;          ///< of the datagram; 0 until the last fragment is here
    std::uint32_t received = 0;        ///< bytes
    bool contested = false;            ///< another datagram contradicted one of this id within the timeout
    std::int64_t contested_ns = 0;     ///< when
    std::vector<Piece> pieces;         ///< sorted, disjoint
    std::unique_ptr<std::byte[]> bytes = std::make_unique_for_overwrite<std::byte[]>(kLargestDatagram);
};

IpReassembly::IpReassembly(const ReassemblyLimits& limits) : limits_(limits) {
    limits_.datagrams = std::max(limits_.datagrams, 1);
    slots_.reserve(static_cast<std::size_t>(limits_.datagrams));
}

IpReassembly::~IpReassembly() = default;

bool IpReassembly::expired(const Slot& slot, std::int64_t time_ns) const {
    // A clock that was set back expires everything too: better a datagram lost than two mixed.
    const std::int64_t age_ns = time_ns - slot.first_ns;
    return age_ns > limits_.timeout_ns || age_ns < -limits_.timeout_ns ||
           counters_.fragments.value() - slot.first_fragment > limits_.timeout_fragments;
}

void IpReassembly::give_up(Slot& slot, Counter& reason) {
    if (slot.state == State::kWaiting) ++reason;
    slot.state = State::kFree;
    slot.contested = false;
}

void IpReassembly::begin(Slot& slot, std::int64_t time_ns) {
    slot.state = State::kWaiting;
    slot.first_ns = time_ns;
    slot.first_fragment = counters_.fragments.value();
    slot.length = 0;
    slot.received = 0;
    slot.contested = slot.contested && time_ns - slot.contested_ns <= limits_.timeout_ns;
    slot.pieces.clear();
}

void IpReassembly::condemn(Slot& slot, std::int64_t time_ns) {
    slot.state = State::kCondemned;
    slot.contested = true;
    slot.contested_ns = time_ns;
}

void IpReassembly::expire(std::int64_t time_ns) {
    for (auto& slot : slots_) {
        if (slot->state != State::kFree && expired(*slot, time_ns)) give_up(*slot, counters_.timed_out);
    }
}

IpReassembly::Slot& IpReassembly::take_slot() {
    Slot* best = nullptr;
    for (auto& slot : slots_) {
        if (slot->state == State::kFree) return *slot;
    }
    if (slots_.size() < static_cast<std::size_t>(limits_.datagrams)) {
        return *slots_.emplace_back(std::make_unique<Slot>());
    }
    // The oldest complete one, else the oldest.
    for (auto& slot : slots_) {
        const bool complete = slot->state == State::kComplete;
        const bool best_complete = best != nullptr && best->state == State::kComplete;
        if (best == nullptr || (complete && !best_complete) ||
            (complete == best_complete && slot->first_fragment < best->first_fragment)) {
            best = slot.get();
        }
    }
    give_up(*best, counters_.evicted);
    return *best;
}

Bytes IpReassembly::add(const IpPacket& fragment, std::uint32_t vlan, std::int64_t time_ns) {
    ++counters_.fragments;
    delivered_ = nullptr;
    if (time_ns >= next_sweep_ns_ || time_ns < next_sweep_ns_ - 2 * limits_.timeout_ns) {
        expire(time_ns);
        next_sweep_ns_ = time_ns + limits_.timeout_ns / 4;
    }

    const std::size_t size = fragment.payload.size();
    const bool last = !fragment.more_fragments;
    if (size == 0 || fragment.offset + size > kLargestDatagram || (!last && size % 8 != 0)) {
        ++counters_.malformed;
        return {};
    }
    const Piece piece{fragment.offset, static_cast<std::uint32_t>(fragment.offset + size)};

    const Key key{fragment.id, fragment.source, fragment.destination, vlan, fragment.protocol};
    const auto holds_key = [&](const Slot& s) { return s.state != State::kFree && s.key == key; };
    Slot* slot = recent_ != nullptr && holds_key(*recent_) ? recent_ : nullptr;
    if (slot == nullptr) {
        const auto found = std::find_if(slots_.begin(), slots_.end(), [&](const auto& s) { return holds_key(*s); });
        if (found != slots_.end()) slot = found->get();
    }
    if (slot != nullptr && expired(*slot, time_ns)) give_up(*slot, counters_.timed_out);

    const auto repeats = [&](const Slot& s) {
        return std::any_of(s.pieces.begin(), s.pieces.end(),
                           [&](const Piece& p) { return p.begin == piece.begin && p.end == piece.end; }) &&
               std::memcmp(s.bytes.get() + piece.begin, fragment.payload.data(), size) == 0 &&
               (!last || s.length == piece.end);
    };

    if (slot != nullptr && slot->state == State::kCondemned && piece.begin != 0) {
        ++counters_.rejected_fragments;
        return {};
    }
    if (slot != nullptr && (slot->state == State::kWaiting || slot->state == State::kComplete) && repeats(*slot)) {
        ++counters_.duplicate_fragments;
        return {};
    }
    if (slot == nullptr) {
        slot = &take_slot();
        slot->key = key;
        begin(*slot, time_ns);
    } else if (slot->state != State::kWaiting) {
        // The id of a delivered datagram with other bytes, or a first fragment after a contradiction: a new datagram.
        begin(*slot, time_ns);
    }
    recent_ = slot;

    const auto position = [&] {
        return std::lower_bound(slot->pieces.begin(), slot->pieces.end(), piece,
                                [](const Piece& a, const Piece& b) { return a.begin < b.begin; });
    };
    auto next = position();
    const bool overlaps = (next != slot->pieces.end() && next->begin < piece.end) ||
                          (next != slot->pieces.begin() && std::prev(next)->end > piece.begin);
    const bool contradicts_length = (slot->length != 0 && (last || piece.end > slot->length)) ||
                                    (last && !slot->pieces.empty() && slot->pieces.back().end > piece.end);
    const bool out_of_turn = slot->contested && piece.begin != slot->received;
    if (overlaps || contradicts_length || out_of_turn) {
        ++counters_.overlapping;
        condemn(*slot, time_ns);
        if (piece.begin != 0) return {};
        // Senders that use one id for everything begin the next datagram so, after a fragment was lost.
        begin(*slot, time_ns);
        next = position();
    }
    if (slot->pieces.size() >= static_cast<std::size_t>(limits_.fragments)) {
        ++counters_.evicted;
        condemn(*slot, time_ns);
        return {};
    }

    slot->pieces.insert(next, piece);
    std::memcpy(slot->bytes.get() + piece.begin, fragment.payload.data(), size);
    slot->received += static_cast<std::uint32_t>(size);
    if (last) slot->length = piece.end;
    if (slot->length == 0 || slot->received != slot->length) return {};
    slot->state = State::kComplete;
    delivered_ = slot;
    ++counters_.reassembled;
    return Bytes(slot->bytes.get(), slot->length);
}

bool IpReassembly::contested() const {
    return delivered_ != nullptr && delivered_->contested;
}

void IpReassembly::refuse(std::int64_t time_ns) {
    if (delivered_ != nullptr) condemn(*delivered_, time_ns);
    delivered_ = nullptr;
}

void IpReassembly::finish() {
    for (auto& slot : slots_) give_up(*slot, counters_.timed_out);
}

void IpReassembly::visit_counters(const CounterVisitor& visit) const {
    visit("ip_fragments", counters_.fragments.value());
    visit("reassembled_datagrams", counters_.reassembled.value());
    visit("duplicate_fragments", counters_.duplicate_fragments.value());
    visit("overlapping_datagrams", counters_.overlapping.value());
    visit("rejected_fragments", counters_.rejected_fragments.value());
    visit("timed_out_datagrams", counters_.timed_out.value());
    visit("evicted_datagrams", counters_.evicted.value());
    visit("malformed_fragments", counters_.malformed.value());
}

}  // namespace dlod::driver
