#include "daemon/publish/queued_bus.hpp"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <mutex>
#include <utility>
#include <vector>

namespace dlod::daemon {
namespace {

using Clock = std::chrono::steady_clock;

/// After a message that could not be sent: a server that is away is not looked for with each of them, and the longer it
/// is away, the less often, as LCM tells of each attempt in the log.
constexpr auto kFirstPause = std::chrono::seconds(1);
constexpr auto kLongestPause = std::chrono::seconds(8);
constexpr auto kLeastPatienceAtTheEnd = std::chrono::milliseconds(200);

struct Message {
    std::string channel;
    std::vector<std::byte> bytes;
};

}  // namespace

struct QueuedBus::State {
    std::function<std::unique_ptr<MessageBus>()> open;
    std::chrono::milliseconds patience;

    std::mutex mutex;  ///< guards all that follows
    std::condition_variable changed;
    std::array<Message, kMostWaiting> ring;  ///< its messages keep their memory
    std::size_t oldest = 0;
    std::size_t waiting = 0;
    Clock::time_point moved;  ///< when a message last got out, or began to wait alone
    std::uint64_t lost = 0;
    bool stopping = false;   ///< what waits is sent, if it can be
    bool abandoned = false;  ///< nobody waits for that any more
    bool ended = false;

    Message& at(std::size_t place) { return ring[(oldest + place) % ring.size()]; }
    void take_oldest() {
        oldest = (oldest + 1) % ring.size();
        --waiting;
    }
    void put(const std::string& channel, std::span<const std::byte> bytes);
    void send_until_stopped();
};

void QueuedBus::State::put(const std::string& channel, std::span<const std::byte> bytes) {
    std::unique_lock lock(mutex);
    while (waiting == ring.size() && Clock::now() < moved + patience) changed.wait_until(lock, moved + patience);
    if (waiting == ring.size()) {
        take_oldest();
        ++lost;
    }
    if (waiting == 0) moved = Clock::now();
    Message& message = at(waiting++);
    message.channel = channel;
    message.bytes.assign(bytes.begin(), bytes.end());
    changed.notify_all();
}

void QueuedBus::State::send_until_stopped() {
    std::unique_ptr<MessageBus> bus;
    Message message;
    auto pause = kFirstPause;
    std::unique_lock lock(mutex);
    while (true) {
        changed.wait(lock, [this] { return stopping || waiting > 0; });
        if (waiting == 0 || abandoned) break;
        std::swap(message, at(0));
        take_oldest();
        lock.unlock();
        if (!bus) bus = open();
        const bool sent = bus && bus->publish(message.channel, message.bytes);
        lock.lock();
        if (sent) {
            moved = Clock::now();
            pause = kFirstPause;
            changed.notify_all();
        } else {
            ++lost;
            if (changed.wait_for(lock, pause, [this] { return stopping; })) break;
            pause = std::min(2 * pause, kLongestPause);
        }
    }
    lock.unlock();
    bus.reset();
    lock.lock();
    ended = true;
    changed.notify_all();
}

QueuedBus::QueuedBus(std::function<std::unique_ptr<MessageBus>()> open, std::chrono::milliseconds patience)
    : state_(std::make_shared<State>()) {
    state_->open = std::move(open);
    state_->patience = patience;
    thread_ = std::thread([state = state_] {
        ::pthread_setname_np(::pthread_self(), "dlod-lcm");
        state->send_until_stopped();
    });
}

QueuedBus::~QueuedBus() {
    std::unique_lock lock(state_->mutex);
    state_->stopping = true;
    state_->changed.notify_all();
    const auto patience = std::max(state_->patience, kLeastPatienceAtTheEnd);
    state_->abandoned = !state_->changed.wait_for(lock, patience, [this] { return state_->ended; });
    lock.unlock();
    if (state_->abandoned) {
        thread_.detach();
    } else {
        thread_.join();
    }
}

bool QueuedBus::publish(const std::string& channel, std::span<const std::byte> message) {
    state_->put(channel, message);
    return true;
}

std::uint64_t QueuedBus::lost() const {
    const std::lock_guard lock(state_->mutex);
    return state_->lost;
}

}  // namespace dlod::daemon
