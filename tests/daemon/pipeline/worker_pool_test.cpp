#include "daemon/pipeline/worker_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <thread>

namespace dlod::daemon {
namespace {

/// Counts up to a limit; run() would lose counts if two threads were in it at once.
class CountingActor final : public Actor {
  public:
    explicit CountingActor(int limit) : limit_(limit) {}
    bool ready() const override { return done_.load() < limit_; }
    void run() override {
        ++unguarded_;
        done_.store(unguarded_);
    }
    int count() const { return done_.load(); }

  private:
    int limit_;
    int unguarded_ = 0;
    std::atomic<int> done_{0};
};

TEST(WorkerPool, RunsEachActorOnOneThreadAtATime) {
    constexpr int kLimit = 20'000;
    CountingActor a(kLimit);
    CountingActor b(kLimit);
    EventCount events;
    std::atomic<int> pieces{0};
    {
        WorkerPool pool({&a, &b}, events, [&] {
            ++pieces;
            pieces.notify_all();
        });
        pool.start(4);
        for (int seen = pieces.load(); seen < 2 * kLimit; seen = pieces.load()) pieces.wait(seen);
    }
    EXPECT_EQ(a.count(), kLimit);
    EXPECT_EQ(b.count(), kLimit);
}

TEST(WorkerPool, IdleWorkersSleep) {
    CountingActor none(0);
    EventCount events;
    WorkerPool pool({&none}, events, [] {});
    pool.start(4);
    const auto cpu_s = [] {
        timespec t{};
        ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
        return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    };
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const double before = cpu_s();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_LT(cpu_s() - before, 0.03);
}

TEST(WorkerPool, StopsAtAnyMoment) {
    for (int i = 0; i < 2000; ++i) {
        CountingActor some(i % 3);
        EventCount events;
        WorkerPool pool({&some}, events, [] {});
        pool.start(2);
        for (int spin = 0; spin < i % 50; ++spin) std::this_thread::yield();
        pool.stop();
    }
}

TEST(WorkerPool, AFailureEndsAllWork) {
    class FailingActor final : public Actor {
        bool ready() const override { return true; }
        void run() override { throw std::runtime_error("broken"); }
    } failing;
    EventCount events;
    std::atomic<bool> told{false};
    WorkerPool pool({&failing}, events, [&] {
        told = true;
        told.notify_all();
    });
    pool.start(2);
    told.wait(false);
    ASSERT_TRUE(pool.failed());
    EXPECT_THROW(std::rethrow_exception(pool.failure()), std::runtime_error);
}

}  // namespace
}  // namespace dlod::daemon
