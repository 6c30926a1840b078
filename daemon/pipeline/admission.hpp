// Which frames a live run works on when the computer is too slow for all of them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace dlod::daemon {

/// Keeps the time from a frame's last packet to its publication within a bound. A frame that could not be published in
/// time any more is not begun; while frames at work side by side hold each other up beyond the bound, one is worked on
/// at a time. What to expect is learnt from the frames before: at once when it gets worse, slowly when it gets better.
///
/// taken() is for the thread that takes frames, published() for the one that publishes them; the rest for any.
class Admission {
  public:
    /// @param bound_ns 0: every frame is admitted
    explicit Admission(std::int64_t bound_ns) : bound_ns_(bound_ns) {}

    /// May a frame be begun beside those at work?
    bool open() const { return bound_ns_ == 0 || at_work() == 0 || shared_ns_.load() <= bound_ns_; }

    /// Would a frame whose last packet came `waited_ns` ago be published too late, were it begun now? Where no frame
    /// can be in time, one that has only just come is.
    bool too_late(std::int64_t waited_ns) const {
        if (bound_ns_ == 0) return false;
        if (at_work() > 0) return waited_ns + shared_ns_.load() > bound_ns_;
        return waited_ns > std::max(bound_ns_ - alone_ns_.load(), bound_ns_ / 8);
    }

    /// What a frame at work carries with it.
    struct Mark {
        std::int64_t taken_ns = 0;
        std::uint64_t number = 0;  ///< of frames taken, this one included
        bool alone = false;        ///< none was at work before it
    };
    Mark taken(std::int64_t now_ns) {
        const bool alone = at_work() == 0;
        taken_.store(taken_.load() + 1);
        return {now_ns, taken_.load(), alone};
    }
    void published(const Mark& mark, std::int64_t now_ns) {
        // Beyond twice the bound it makes no difference, and would be remembered for long.
        const std::int64_t took_ns = std::min(now_ns - mark.taken_ns, 2 * bound_ns_);
        if (mark.alone && taken_.load() == mark.number) learn(alone_ns_, took_ns, 16);
        learn(shared_ns_, took_ns, 128);
        published_.store(published_.load() + 1);
    }

  private:
    static void learn(std::atomic<std::int64_t>& expected_ns, std::int64_t took_ns, std::int64_t frames) {
        const std::int64_t before_ns = expected_ns.load();
        expected_ns.store(std::max(took_ns, before_ns - (before_ns - took_ns) / frames));
    }
    std::uint64_t at_work() const { return taken_.load() - published_.load(); }

    const std::int64_t bound_ns_;
    std::atomic<std::uint64_t> taken_{0};
    std::atomic<std::uint64_t> published_{0};
    std::atomic<std::int64_t> alone_ns_{0};   ///< from taken to published, of a frame that nothing holds up
    std::atomic<std::int64_t> shared_ns_{0};  ///< of one beside others
};

}  // namespace dlod::daemon
