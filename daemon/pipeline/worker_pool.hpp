// Threads that run the stages: any worker takes any stage that is ready, each stage runs on one worker at a time.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

namespace dlod::daemon {

/// Lets threads sleep until something has happened, without missing it:
///     const auto ticket = events.ticket();
///     if (nothing to do) events.wait(ticket);
class EventCount {
  public:
    std::uint32_t ticket() const { return epoch_.load(std::memory_order_acquire); }
    /// Returns as soon as notify() was called after `ticket` was drawn.
    void wait(std::uint32_t ticket) const { epoch_.wait(ticket, std::memory_order_acquire); }
    void notify() {
        epoch_.fetch_add(1, std::memory_order_acq_rel);
        epoch_.notify_all();
    }

  private:
    std::atomic<std::uint32_t> epoch_{0};
};

/// Work that is done piece by piece, never by two threads at once.
class Actor {
  public:
    virtual ~Actor() = default;
    /// True where run() has something to do and room to put its result. Any thread may ask; the answer is certain only
    /// for who holds the claim.
    virtual bool ready() const = 0;
    /// One piece of work; called with the claim held.
    virtual void run() = 0;

    bool try_claim() { return !claimed_.exchange(true, std::memory_order_acquire); }
    void release() { claimed_.store(false, std::memory_order_release); }

  private:
    std::atomic<bool> claimed_{false};
};

class WorkerPool {
  public:
    /// @param actors in order of urgency, all must outlive the pool
    /// @param on_progress called after each piece of work, on the thread that did it
    WorkerPool(std::vector<Actor*> actors, EventCount& events, std::function<void()> on_progress)
        : actors_(std::move(actors)), events_(events), on_progress_(std::move(on_progress)) {}
    ~WorkerPool() { stop(); }
    WorkerPool(const WorkerPool&) = delete;
    WorkerPool& operator=(const WorkerPool&) = delete;

    /// @param on_start called first on each thread, with its number
    void start(int threads, const std::function<void(int)>& on_start = {});
    /// Ends the threads after what they are at.
    void stop();

    /// True once an actor has thrown: nothing runs any more.
    bool failed() const { return failed_.load(std::memory_order_acquire); }
    /// What the actor threw; only after failed().
    std::exception_ptr failure() const { return failure_; }

  private:
    void work();
    bool run_one();

    std::vector<Actor*> actors_;
    EventCount& events_;
    std::function<void()> on_progress_;
    std::atomic<bool> stopping_{false};
    std::atomic<bool> failing_{false};  ///< the first to set it writes failure_
    std::atomic<bool> failed_{false};
    std::exception_ptr failure_;
    std::vector<std::thread> threads_;
};

}  // namespace dlod::daemon
