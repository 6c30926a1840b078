#include "daemon/pipeline/worker_pool.hpp"

namespace dlod::daemon {

void WorkerPool::start(int threads, const std::function<void(int)>& on_start) {
    for (int i = 0; i < threads; ++i) {
        threads_.emplace_back([this, i, on_start] {
            if (on_start) on_start(i);
            work();
        });
    }
}

void WorkerPool::stop() {
    stopping_.store(true, std::memory_order_release);
    events_.notify();
    for (auto& thread : threads_) thread.join();
    threads_.clear();
}

void WorkerPool::work() {
    while (true) {
        // Drawn before anything is looked at: what happens from here on ends the wait.
        const auto ticket = events_.ticket();
        if (stopping_.load(std::memory_order_acquire) || failed()) return;
        if (!run_one()) events_.wait(ticket);
    }
}

bool WorkerPool::run_one() {
    for (Actor* actor : actors_) {
        if (!actor->ready() || !actor->try_claim()) continue;
        const bool has_work = actor->ready();
        try {
            if (has_work) actor->run();
        } catch (...) {
            if (!failing_.exchange(true)) {
                failure_ = std::current_exception();
                failed_.store(true, std::memory_order_release);
            }
        }
        actor->release();
        // Also where there was none: somebody may have seen the claim and gone to sleep.
        events_.notify();
        if (has_work) {
            on_progress_();
            return true;
        }
    }
    return false;
}

}  // namespace dlod::daemon
